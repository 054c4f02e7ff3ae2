//! Config files that name a base and hold only what differs from it.

use crate::{ConfigError, overlay, parse};

/// Field by which a config names its base.
const BASE: &str = "base";

/// Completes a config from its base. With `base = "NAME"` in `table`, returns the table of that base (its own base included) with the
/// entries of `table` laid over it; without, returns `table`. `text_of` returns the TOML text of a base by its name; `file` names
/// the config in errors.
///
/// Tables merge entry by entry; constants, arrays and all other values replace those of the base. Of a table named in `choices` a config
/// chooses one entry, and another choice replaces the base's table.
///
/// # Errors
/// `base` is not text, `text_of` knows no such name, or the base is not TOML.
pub fn with_base(
    file: &str,
    mut table: toml::Table,
    text_of: &dyn Fn(&str) -> Result<&'static str, String>,
    choices: &[&str],
) -> Result<toml::Table, ConfigError> {
    let Some(base) = table.remove(BASE) else { return Ok(table) };
    let named = base.as_str().ok_or_else(|| "the name of a base is text".to_owned());
    let found = named.and_then(|name| Ok((name, text_of(name)?)));
    let (name, text) =
        found.map_err(|problem| ConfigError { file: file.to_owned(), field: BASE.to_owned(), problem })?;
    let mut whole = with_base(name, parse(name, text)?, text_of, choices)?;
    overlay(&mut whole, table, choices);
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOT: &str = "[a]\nx = { value = 1, unit = 'm' }\ny = 2\n[b]\nz = [1, 2]";
    const CHILD: &str = "base = 'root'\n[a]\nx = { value = 3 }";

    fn text_of(name: &str) -> Result<&'static str, String> {
        match name {
            "root" => Ok(ROOT),
            "child" => Ok(CHILD),
            _ => Err(format!("no config '{name}'")),
        }
    }

    fn read(text: &str) -> Result<toml::Table, ConfigError> {
        with_base("x.toml", parse("x.toml", text)?, &text_of, &[])
    }

    #[test]
    fn entries_replace_those_of_the_base_and_of_its_base() {
        let whole = read("base = 'child'\n[b]\nz = [5]\n[c]\nw = 4").unwrap();
        let expected = "[a]\nx = { value = 3 }\ny = 2\n[b]\nz = [5]\n[c]\nw = 4";
        assert_eq!(whole, parse("x.toml", expected).unwrap());
        assert_eq!(read(ROOT).unwrap(), parse("x.toml", ROOT).unwrap());
    }

    #[test]
    fn a_base_that_is_no_name_or_unknown_is_refused() {
        for (text, message) in [
            ("base = 3", "x.toml: base: the name of a base is text"),
            ("base = 'lemon'", "x.toml: base: no config 'lemon'"),
        ] {
            assert_eq!(read(text).unwrap_err().to_string(), message);
        }
    }
}
