//! The parameters that are screened, read from a file.

use orchard_geometry::math;
use orchard_quantity::{ConfigError, Unit, from_toml};
use orchard_spec::Spec;
use serde::{Deserialize, Serialize};

/// Parameters with the ranges to explore: `configs/measured/sensitivity.toml`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// The parameters.
    pub parameters: Vec<Parameter>,
    /// Name of the file, for errors.
    #[serde(skip)]
    file: String,
}

/// A figure of a world config and the range in which it is changed.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Short name, for pictures.
    pub name: String,
    /// Dotted path in the config.
    pub path: String,
    /// Low end of the range.
    pub low: f64,
    /// High end of the range.
    pub high: f64,
    /// Unit of both ends, the same as the figure's.
    pub unit: Unit,
    /// Steps of the range.
    pub scale: Scale,
    /// Key of the range's source.
    pub source: String,
    /// Reason for the range.
    pub why: String,
}

/// Division of a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// By equal differences.
    Linear,
    /// By equal ratios.
    Logarithmic,
}

impl Parameter {
    /// The value at a share of the range, from 0 to 1.
    pub fn at(&self, share: f64) -> f64 {
        let Self { low, high, .. } = *self;
        let value = match self.scale {
            Scale::Linear => low + share * (high - low),
            Scale::Logarithmic => low * math::exp(share * math::ln(high / low)),
        };
        value.clamp(low, high)
    }

    /// Field and problem, if the parameter does not fit to the spec.
    fn problem(&self, spec: &Spec) -> Option<(&'static str, String)> {
        let Some(figure) = spec.figure(&self.path) else {
            let problem = format!(
                "no constant with a single value of preset {} is called '{}'",
                spec.preset, self.path
            );
            return Some(("path", problem));
        };
        if figure.unit() != self.unit {
            let (own, of) = (self.unit.symbol(), figure.unit().symbol());
            return Some(("unit", format!("'{own}' is not the unit of {}, '{of}'", self.path)));
        }
        for (field, end) in [("low", self.low), ("high", self.high)] {
            if let Err(problem) = figure.with_value(end) {
                return Some((field, problem));
            }
        }
        if self.low >= self.high {
            return Some(("low", format!("{} is not below high, {}", self.low, self.high)));
        }
        (self.scale == Scale::Logarithmic && self.low <= 0.0)
            .then(|| ("low", format!("{} is not above 0, as a logarithmic scale needs", self.low)))
    }
}

impl Parameters {
    /// Reads parameters of a spec.
    ///
    /// # Errors
    /// Not TOML, a field missing or unknown, a path without a figure or given twice, another unit, ends outside the figure's range or in the wrong
    /// order, or fewer than one parameter.
    pub fn read(file: &str, text: &str, spec: &Spec) -> Result<Self, ConfigError> {
        let mut read: Self = from_toml(file, text)?;
        file.clone_into(&mut read.file);
        let error = |field: String, problem: String| ConfigError { file: file.to_owned(), field, problem };
        if read.parameters.is_empty() {
            return Err(error("parameters".to_owned(), "the list is empty".to_owned()));
        }
        for (i, parameter) in read.parameters.iter().enumerate() {
            let twice = read.parameters[..i].iter().any(|other| other.path == parameter.path);
            let twice = twice.then(|| ("path", format!("'{}' is given twice", parameter.path)));
            if let Some((field, problem)) = twice.or_else(|| parameter.problem(spec)) {
                return Err(error(format!("parameters[{i}].{field}"), problem));
            }
        }
        Ok(read)
    }

    /// The spec with every parameter at a share of its range.
    ///
    /// # Errors
    /// Figures that do not go together.
    pub fn applied(&self, spec: &Spec, shares: &[f64]) -> Result<Spec, ConfigError> {
        let figures = self.parameters.iter().zip(shares).map(|(of, share)| (&*of.path, of.at(*share)));
        spec.with_figures(&self.file, &figures.collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "[[parameters]]\nname = 'd'\npath = 'wood.density'\nlow = 800\nhigh = 900\nunit = 'kg/m3'\n\
                        scale = 'linear'\nsource = 'x'\nwhy = 'y'\n";

    fn read(text: &str) -> Result<Parameters, String> {
        Parameters::read("p.toml", text, &Spec::paper()).map_err(|e| e.to_string())
    }

    #[test]
    fn shares_are_places_in_the_range() {
        let parameter = read(GOOD).unwrap().parameters.remove(0);
        assert_eq!([0.0, 0.25, 1.0].map(|share| parameter.at(share)), [800.0, 825.0, 900.0]);
        let log = Parameter { low: 1.0, high: 100.0, scale: Scale::Logarithmic, ..parameter };
        assert!((log.at(0.5) - 10.0).abs() < 1e-12);
        assert_eq!([log.at(0.0), log.at(1.0)], [1.0, 100.0]);
        let spec = read(GOOD).unwrap().applied(&Spec::paper(), &[0.5]).unwrap();
        assert_eq!(spec.wood.density.si(), 850.0);
    }

    #[test]
    fn bad_files_are_refused_with_field_value_and_range() {
        let changed = |from: &str, to: &str| read(&GOOD.replace(from, to)).unwrap_err();
        for (from, to, message) in [
            ("low = 800", "low = 8", "low: 8 is outside the allowed range [780, 1000] kg/m3"),
            ("high = 900", "high = 9000", "high: 9000 is outside the allowed range [780, 1000] kg/m3"),
            ("low = 800", "low = nan", "low: NaN is outside the allowed range [780, 1000] kg/m3"),
            ("low = 800", "low = 900", "low: 900 is not below high, 900"),
            ("kg/m3", "kg", "unit: 'kg' is not the unit of wood.density, 'kg/m3'"),
            (
                "density",
                "densty",
                "path: no constant with a single value of preset paper is called 'wood.densty'",
            ),
        ] {
            assert_eq!(changed(from, to), format!("p.toml: parameters[0].{message}"));
        }
        assert_eq!(
            read(&GOOD.repeat(2)).unwrap_err(),
            "p.toml: parameters[1].path: 'wood.density' is given twice"
        );
        assert_eq!(read("parameters = []").unwrap_err(), "p.toml: parameters: the list is empty");
        assert!(
            changed("why", "because").starts_with("p.toml: parameters[0]"),
            "{}",
            changed("why", "because")
        );
        let e = GOOD
            .replace("wood.density", "terrain.persistence")
            .replace("kg/m3", "1")
            .replace("linear", "logarithmic");
        let e = read(&e.replace("800", "0").replace("900", "1")).unwrap_err();
        assert_eq!(e, "p.toml: parameters[0].low: 0 is not above 0, as a logarithmic scale needs");
    }
}
