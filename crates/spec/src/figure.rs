//! Single figures of a spec, named by their dotted paths.

use orchard_quantity::{ConfigError, Quantity, from_table};

use crate::Spec;

impl Spec {
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
            let changed = figure.with_value(value).map_err(|problem| error(path, problem))?;
            let changed = toml::Value::try_from(changed).map_err(|e| error(path, e.to_string()))?;
            // The path leads to a constant: all its steps exist.
            let mut steps = path.split('.');
            let first = steps.next().and_then(|step| table.get_mut(step));
            if let Some(place) = steps.fold(first, |at, step| at.and_then(|value| value.get_mut(step))) {
                *place = changed;
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
