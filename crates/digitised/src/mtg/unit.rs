//! Units of an MTG file: the format has no place for them, and files use metres, centimetres, millimetres and tenths of them.

use std::fmt;
use std::str::FromStr;

use orchard_quantity::Unit;

/// A unit of length, or a multiple of one, such as `0.1mm`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measure {
    multiple: f64,
    unit: Unit,
}

/// Units of a file, written `LENGTH` or `LENGTH,DIAMETER`: `m`, `mm`, `cm,mm`, `mm,0.1mm`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Unit of positions and lengths.
    pub length: Measure,
    /// Unit of diameters.
    pub diameter: Measure,
}

const METRE: Measure = Measure { multiple: 1.0, unit: Unit::Metre };

impl Units {
    /// Metres for all.
    pub const METRES: Self = Self { length: METRE, diameter: METRE };
}

impl Measure {
    /// Metres in one.
    pub fn si(self) -> f64 {
        self.multiple * self.unit.to_si()
    }

    /// A length in metres as text in this measure.
    pub(super) fn text(self, metres: f64) -> String {
        let symbol = self.unit.symbol();
        format!("{} ({} {symbol})", metres / self.si(), metres / self.unit.to_si())
    }
}

impl FromStr for Measure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let (multiple, symbol) = text.split_at(text.find(char::is_alphabetic).unwrap_or(text.len()));
        let unit =
            [Unit::Metre, Unit::Centimetre, Unit::Millimetre].into_iter().find(|u| u.symbol() == symbol);
        let multiple = if multiple.is_empty() { Some(1.0) } else { multiple.trim().parse().ok() };
        match (multiple, unit) {
            (Some(multiple), Some(unit)) if multiple > 0.0 && f64::is_finite(multiple) => {
                Ok(Self { multiple, unit })
            }
            _ => Err(format!("{text:?} is no unit: m, cm, mm, or a multiple such as 0.1mm")),
        }
    }
}

impl FromStr for Units {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (length, diameter) = text.split_once(',').unwrap_or((text, text));
        Ok(Self { length: length.parse()?, diameter: diameter.parse()? })
    }
}

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.multiple != 1.0 {
            write!(f, "{}", self.multiple)?;
        }
        f.write_str(self.unit.symbol())
    }
}

impl fmt::Display for Units {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}", self.length)?;
        if self.diameter == self.length { Ok(()) } else { write!(f, ",{}", self.diameter) }
    }
}
