//! Configuration values that carry their range, unit and source.
//!
//! Every physical or protocol constant of the project is written in a config file as
//!
//! ```toml
//! density = { value = 850.0, range = [780.0, 1000.0], unit = "kg/m3", source = "fpl2010woodhandbook" }
//! crotch_angle = { low = 42.0, high = 65.0, range = [0.0, 90.0], unit = "deg", source = "orchardbench" }
//! trunk_radius = { mean = 27.0, sd = 2.0, low = 25.0, high = 30.0, range = [1.0, 500.0], unit = "mm", source = "brym2018" }
//! ```
//!
//! and read into a [`Quantity`], a [`Span`] or a [`Normal`]. A value outside its range is refused when the file is read.
//! [`Quantity::si`] and [`Span::si`] give SI numbers, so that millimetres or degrees never reach the physics.
//! `source` is a key of `docs/references.bib`; `cargo xtask tidy` checks that it resolves.

mod base;
mod limits;
mod overlay;
mod parse;
mod tracked;
mod unit;

pub use base::with_base;
pub use limits::CountLimits;
pub use overlay::overlay;
pub use parse::{ConfigError, from_table, from_toml, parse};
pub use unit::Unit;

use serde::{Deserialize, Serialize};

/// A scalar constant with its allowed range, unit and source key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawQuantity")]
pub struct Quantity {
    value: f64,
    range: [f64; 2],
    unit: Unit,
    source: String,
}

/// An interval from which a quantity is drawn, with the allowed range of both ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawSpan")]
pub struct Span {
    low: f64,
    high: f64,
    range: [f64; 2],
    unit: Unit,
    source: String,
}

/// A normal distribution cut off at both ends, with the allowed range of the ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawNormal")]
pub struct Normal {
    mean: f64,
    sd: f64,
    low: f64,
    high: f64,
    range: [f64; 2],
    unit: Unit,
    source: String,
}

/// A whole number with its allowed range, unit (what is counted) and source key.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "RawCount")]
pub struct Count {
    value: u32,
    range: [u32; 2],
    unit: String,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawQuantity {
    value: f64,
    range: [f64; 2],
    unit: Unit,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSpan {
    low: f64,
    high: f64,
    range: [f64; 2],
    unit: Unit,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawNormal {
    mean: f64,
    sd: f64,
    low: f64,
    high: f64,
    range: [f64; 2],
    unit: Unit,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCount {
    value: u32,
    range: [u32; 2],
    unit: String,
    source: String,
}

fn check<T: PartialOrd + std::fmt::Display>(value: T, range: &[T; 2], unit: &str) -> Result<(), String> {
    if value >= range[0] && value <= range[1] {
        Ok(())
    } else {
        Err(format!("{value} is outside the allowed range [{}, {}] {unit}", range[0], range[1]))
    }
}

impl TryFrom<RawQuantity> for Quantity {
    type Error = String;

    fn try_from(raw: RawQuantity) -> Result<Self, String> {
        check(raw.value, &raw.range, raw.unit.symbol())?;
        Ok(Self { value: raw.value, range: raw.range, unit: raw.unit, source: raw.source })
    }
}

impl TryFrom<RawSpan> for Span {
    type Error = String;

    fn try_from(raw: RawSpan) -> Result<Self, String> {
        check(raw.low, &raw.range, raw.unit.symbol())?;
        check(raw.high, &raw.range, raw.unit.symbol())?;
        if raw.low > raw.high {
            return Err(format!("low {} is above high {}", raw.low, raw.high));
        }
        Ok(Self { low: raw.low, high: raw.high, range: raw.range, unit: raw.unit, source: raw.source })
    }
}

impl TryFrom<RawNormal> for Normal {
    type Error = String;

    fn try_from(raw: RawNormal) -> Result<Self, String> {
        let RawNormal { mean, sd, low, high, range, unit, source } = raw;
        check(low, &range, unit.symbol())?;
        check(high, &range, unit.symbol())?;
        // Draws outside the ends are drawn again; with the mean between the ends this is rare.
        check(mean, &[low, high], unit.symbol())?;
        check(sd, &[0.0, range[1] - range[0]], unit.symbol())?;
        Ok(Self { mean, sd, low, high, range, unit, source })
    }
}

impl TryFrom<RawCount> for Count {
    type Error = String;

    fn try_from(raw: RawCount) -> Result<Self, String> {
        check(raw.value, &raw.range, &raw.unit)?;
        Ok(Self { value: raw.value, range: raw.range, unit: raw.unit, source: raw.source })
    }
}

impl Quantity {
    /// The value in SI units (radians for angles).
    #[inline]
    pub fn si(&self) -> f64 {
        self.value * self.unit.to_si()
    }

    /// The value as written, in [`Quantity::unit`].
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Lowest and highest value that the file allows, in [`Quantity::unit`].
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// The unit that the file states.
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// Key of the source in `docs/references.bib`.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Multiplies value and range by a positive factor.
    pub fn scaled(&self, factor: f64) -> Self {
        debug_assert!(factor > 0.0, "a factor that is not positive would swap the ends of the range");
        Self { value: self.value * factor, range: self.range.map(|end| end * factor), ..self.clone() }
    }

    /// Replaces the value, in the same unit.
    ///
    /// # Errors
    /// The value is outside the allowed range or not a number.
    pub fn with_value(&self, value: f64) -> Result<Self, String> {
        check(value, &self.range, self.unit.symbol())?;
        Ok(Self { value, ..self.clone() })
    }
}

impl Span {
    /// Both ends in SI units (radians for angles).
    #[inline]
    pub fn si(&self) -> (f64, f64) {
        let k = self.unit.to_si();
        (self.low * k, self.high * k)
    }

    /// The middle of the interval in SI units.
    pub fn mid_si(&self) -> f64 {
        let (low, high) = self.si();
        0.5 * (low + high)
    }

    /// Returns a span of zero width at a position between the low end (`part` = 0) and the high end (1).
    pub fn at(&self, part: f64) -> Self {
        let value = self.low + part.clamp(0.0, 1.0) * (self.high - self.low);
        Self { low: value, high: value, ..self.clone() }
    }

    /// Replaces the ends, in the same unit.
    ///
    /// # Errors
    /// An end is outside the allowed range, or the ends are in the wrong order.
    pub fn with_ends(&self, low: f64, high: f64) -> Result<Self, String> {
        let Self { range, unit, source, .. } = self.clone();
        RawSpan { low, high, range, unit, source }.try_into()
    }

    /// True if an SI value lies in the closed interval.
    pub fn contains_si(&self, value: f64) -> bool {
        let (low, high) = self.si();
        (low..=high).contains(&value)
    }

    /// Key of the source in `docs/references.bib`.
    pub fn source(&self) -> &str {
        &self.source
    }
}

impl Normal {
    /// Mean of the distribution before the cut-off, in SI units.
    pub fn mean_si(&self) -> f64 {
        self.mean * self.unit.to_si()
    }

    /// Standard deviation before the cut-off, in SI units.
    pub fn sd_si(&self) -> f64 {
        self.sd * self.unit.to_si()
    }

    /// Both ends, in SI units.
    pub fn ends_si(&self) -> (f64, f64) {
        let k = self.unit.to_si();
        (self.low * k, self.high * k)
    }

    /// Key of the source in `docs/references.bib`.
    pub fn source(&self) -> &str {
        &self.source
    }
}

impl Count {
    /// Value of the count.
    pub fn get(&self) -> u32 {
        self.value
    }

    /// Key of the source in `docs/references.bib`.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Replaces the value.
    ///
    /// # Errors
    /// The value is outside the allowed range.
    pub fn with_value(&self, value: u32) -> Result<Self, String> {
        check(value, &self.range, &self.unit)?;
        Ok(Self { value, ..self.clone() })
    }
}
