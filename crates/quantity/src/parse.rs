//! Reads config files; errors name the file, the field, the value and the allowed range.

use serde::de::DeserializeOwned;

use crate::tracked::{Path, Tracked};

/// Error in a config text, shown in one line: file, field, problem.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {field}: {problem}")]
pub struct ConfigError {
    /// The file's name as the caller gave it.
    pub file: String,
    /// Dotted path of the field; line and column where the text is not TOML; `.` for the whole document.
    pub field: String,
    /// The value and the allowed values.
    pub problem: String,
}

/// Reads a config struct from TOML text; `file` only names the text in errors.
///
/// # Errors
/// The text is not TOML, a field is missing or unknown, or a value is outside its range.
pub fn from_toml<T: DeserializeOwned>(file: &str, text: &str) -> Result<T, ConfigError> {
    from_table(file, parse(file, text)?)
}

/// Reads TOML text into a table.
///
/// # Errors
/// The text is not TOML; the error names line and column.
pub fn parse(file: &str, text: &str) -> Result<toml::Table, ConfigError> {
    text.parse().map_err(|e: toml::de::Error| {
        let place = e.span().map_or_else(|| ".".to_owned(), |span| place(text, span.start));
        error(file, place, e.message())
    })
}

/// Line and column of a byte of a text, both from 1; the column counts characters.
fn place(text: &str, byte: usize) -> String {
    let before = text.get(..byte).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    format!("line {line}, column {column}")
}

/// Reads a config struct from a table.
///
/// # Errors
/// A field is missing or unknown, or a value is outside its range.
pub fn from_table<T: DeserializeOwned>(file: &str, table: toml::Table) -> Result<T, ConfigError> {
    let path = Path::default();
    T::deserialize(Tracked::new(table, &path)).map_err(|e| error(file, path.to_string(), e.message()))
}

fn error(file: &str, field: String, problem: &str) -> ConfigError {
    ConfigError { file: file.to_owned(), field, problem: problem.replace('\n', " ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Normal, Quantity, Span};

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Wood {
        density: Quantity,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Doc {
        wood: Wood,
        angle: Option<Span>,
        radius: Option<Normal>,
    }

    fn read(text: &str) -> Result<Doc, ConfigError> {
        from_toml("a.toml", text)
    }

    #[test]
    fn a_syntax_error_names_line_and_column() {
        let e = parse("a.toml", "[wood]\n'ä' = 1\nx = = 2").unwrap_err().to_string();
        assert!(e.starts_with("a.toml: line 3, column "), "{e}");
        let e = parse("a.toml", "a = 1\na = 2").unwrap_err().to_string();
        assert!(e.starts_with("a.toml: line 2, column "), "{e}");
        let e = parse("a.toml", "x = \"").unwrap_err().to_string();
        assert!(e.starts_with("a.toml: line 1, column "), "{e}");
    }

    #[test]
    fn units_convert_to_si() {
        let doc = read(
            "angle = { low = 90, high = 180, range = [0, 360], unit = 'deg', source = 'x' }\n\
             [wood]\ndensity = { value = 850, range = [780, 1000], unit = 'kg/m3', source = 'x' }",
        )
        .unwrap();
        assert_eq!(doc.wood.density.si(), 850.0);
        let (low, high) = doc.angle.unwrap().si();
        assert!(
            (low - std::f64::consts::FRAC_PI_2).abs() < 1e-15 && (high - std::f64::consts::PI).abs() < 1e-15
        );
    }

    #[test]
    fn a_scaled_quantity_scales_its_range() {
        let doc =
            read("[wood]\ndensity = { value = 850, range = [780, 1000], unit = 'kg/m3', source = 'x' }");
        let density = doc.unwrap().wood.density;
        let half = density.scaled(0.5);
        assert_eq!((half.si(), half.unit(), half.source()), (425.0, density.unit(), "x"));
        assert!(half.with_value(390.0).is_ok() && half.with_value(510.0).is_err());
        assert_eq!(density.scaled(1.0), density);
    }

    #[test]
    fn a_normal_has_its_mean_between_its_ends() {
        let radius = |mean: f64, sd: f64| {
            let line = format!(
                "radius = {{ mean = {mean}, sd = {sd}, low = 20, high = 30, range = [1, 500], unit = 'mm', source = 'x' }}"
            );
            let wood = "[wood]\ndensity = { value = 850, range = [780, 1000], unit = 'kg/m3', source = 'x' }";
            read(&format!("{line}\n{wood}")).map_err(|e| e.to_string())
        };
        let normal = radius(25.0, 2.0).unwrap().radius.unwrap();
        assert_eq!((normal.mean_si(), normal.sd_si(), normal.ends_si()), (0.025, 0.002, (0.02, 0.03)));
        assert_eq!(
            radius(31.0, 2.0).unwrap_err(),
            "a.toml: radius: 31 is outside the allowed range [20, 30] mm"
        );
        assert_eq!(
            radius(25.0, -1.0).unwrap_err(),
            "a.toml: radius: -1 is outside the allowed range [0, 499] mm"
        );
    }

    #[test]
    fn errors_name_file_field_value_and_range() {
        let e = read("[wood]\ndensity = { value = 9000, range = [780, 1000], unit = 'kg/m3', source = 'x' }")
            .unwrap_err()
            .to_string();
        assert_eq!(e, "a.toml: wood.density: 9000 is outside the allowed range [780, 1000] kg/m3");
        for (text, field) in [
            ("[wood]\ndensity = { value = nan, range = [0, 1], unit = '1', source = 'x' }", "wood.density"),
            (
                "[wood]\ndensity = { value = 1, range = [0, 1], unit = 'furlong', source = 'x' }",
                "wood.density",
            ),
            ("[wood]\ndensty = 1", "wood.densty"),
        ] {
            let e = read(text).unwrap_err();
            assert!(e.field.starts_with(field), "{e}");
            assert!(!e.to_string().contains('\n'));
        }
    }
}
