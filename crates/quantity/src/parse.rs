//! Reading a config file with an error that names the file, the field, the value and the allowed range.

use serde::de::DeserializeOwned;

/// A config text that cannot be used. One line: file, field, what is wrong.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {field}: {problem}")]
pub struct ConfigError {
    /// The file's name as the caller gave it.
    pub file: String,
    /// Dotted path of the field, `.` for the whole document.
    pub field: String,
    /// The value and what it should have been.
    pub problem: String,
}

/// Reads a config struct from TOML text; `file` only names the text in errors.
///
/// # Errors
/// The text is not TOML, a field is missing or unknown, or a value leaves its range.
pub fn from_toml<T: DeserializeOwned>(file: &str, text: &str) -> Result<T, ConfigError> {
    let error = |field: String, problem: String| ConfigError { file: file.to_owned(), field, problem };
    let de =
        toml::Deserializer::parse(text).map_err(|e| error(".".into(), e.message().replace('\n', " ")))?;
    serde_path_to_error::deserialize(de)
        .map_err(|e| error(e.path().to_string(), e.inner().message().replace('\n', " ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Quantity, Span};

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
    }

    fn read(text: &str) -> Result<Doc, ConfigError> {
        from_toml("a.toml", text)
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
