//! Single figures of a spec, named by their dotted paths.

use orchard_quantity::{ConfigError, Quantity, from_table};

use crate::{Spec, preset};

/// Field of a constant that holds its value.
const VALUE: &str = "value";

impl Spec {
    /// Returns the spec with changes laid over it, given as a config file gives them that names a preset as its base. `file` names
    /// them in errors.
    ///
    /// # Errors
    /// A field unknown, a value outside its range, a part with an unknown base.
    pub fn overlaid(&self, file: &str, changes: toml::Table) -> Result<Self, ConfigError> {
        preset::overlaid(self, file, changes)
    }

    /// Returns the figure at a dotted path, such as `wood.density`; `None` if there is no constant with a single value.
    pub fn figure(&self, path: &str) -> Option<Quantity> {
        let mut value = toml::Value::Table(toml::Table::try_from(self).ok()?);
        for step in path.split('.') {
            value = value.get(step)?.clone();
        }
        value.try_into().ok()
    }

    /// Returns the spec with other values of some figures, each in the unit of its constant. `file` names the new values in errors.
    ///
    /// # Errors
    /// A path leads to no constant with a single value, a value is outside its constant's range, or the figures do not go together.
    pub fn with_figures(&self, file: &str, figures: &[(&str, f64)]) -> Result<Self, ConfigError> {
        let error = |field: &str, problem: String| ConfigError {
            file: file.to_owned(),
            field: field.to_owned(),
            problem,
        };
        let mut table = toml::Table::try_from(self).map_err(|e| error(".", e.to_string()))?;
        for &(path, value) in figures {
            let figure = self.figure(path).ok_or_else(|| error(path, no_figure(&self.preset)))?;
            figure.with_value(value).map_err(|problem| error(path, problem))?;
            // The path leads to a constant: all its steps exist.
            let mut steps = path.split('.').chain([VALUE]);
            let first = steps.next().and_then(|step| table.get_mut(step));
            match steps.fold(first, |at, step| at.and_then(|value| value.get_mut(step))) {
                // A count stays a whole number.
                Some(place @ toml::Value::Integer(_)) => {
                    if value.fract() != 0.0 {
                        return Err(error(path, format!("{value} is not a whole number")));
                    }
                    *place = toml::Value::Integer(value as i64);
                }
                Some(place) => *place = toml::Value::Float(value),
                None => return Err(error(path, no_figure(&self.preset))),
            }
        }
        from_table(file, table)
    }
}

fn no_figure(preset: &str) -> String {
    format!("no constant with a single value of preset {preset} has this path")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;

    #[test]
    fn a_figure_is_changed_and_nothing_else() {
        let calibrated = Spec::preset(Preset::Calibrated);
        let deep = "fruit.stem.release.pull_strength.lognormal.median";
        let changed = calibrated.with_figures("x.toml", &[("wood.density", 900.0), (deep, 30.0)]).unwrap();
        assert_eq!(changed.wood.density.si(), 900.0);
        assert_eq!(changed.figure(deep).unwrap().value(), 30.0);
        let before = [
            ("wood.density", calibrated.wood.density.value()),
            (deep, calibrated.figure(deep).unwrap().value()),
        ];
        assert_eq!(changed.with_figures("x.toml", &before), Ok(calibrated.clone()));
        assert_eq!(calibrated.with_figures("x.toml", &[]), Ok(calibrated));
    }

    #[test]
    fn bad_paths_and_values_are_named() {
        let error = |path: &str, value: f64| {
            Spec::paper().with_figures("x.toml", &[(path, value)]).unwrap_err().to_string()
        };
        assert_eq!(
            error("wood.density", 9000.0),
            "x.toml: wood.density: 9000 is outside the allowed range [780, 1000] kg/m3"
        );
        assert!(error("wood.density", f64::NAN).starts_with("x.toml: wood.density: NaN is outside"));
        for path in
            ["wood.densty", "wood", "", "wood..density", "fruit.radius", "wood.rigid", "fruit.stem.stiffness"]
        {
            let e = error(path, 1.0);
            assert_eq!(
                e,
                format!("x.toml: {path}: no constant with a single value of preset paper has this path")
            );
        }
    }
}
