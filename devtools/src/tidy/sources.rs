//! Checks that every `source = "key"` in `configs/` and of the robots exists in `docs/references.bib`.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::Context;
use biblatex::Bibliography;

use crate::workspace::{files, relative};

const BIBLIOGRAPHY: &str = "docs/references.bib";

/// Reads all config files and the bibliography under `root`.
pub fn check(root: &Path) -> anyhow::Result<Vec<String>> {
    let text = std::fs::read_to_string(root.join(BIBLIOGRAPHY)).context(BIBLIOGRAPHY)?;
    let bibliography = match Bibliography::parse(&text) {
        Ok(bibliography) => bibliography,
        Err(e) => return Ok(vec![format!("{BIBLIOGRAPHY} cannot be parsed: {e}")]),
    };
    let known: BTreeSet<String> = bibliography.keys().map(str::to_owned).collect();
    let mut errors = Vec::new();
    let configs = files(&root.join("configs"), &["toml"])?;
    let robots = files(&root.join("assets/robots"), &["toml"])?;
    for path in configs.into_iter().chain(robots) {
        let name = relative(root, &path);
        let document: toml::Table = match std::fs::read_to_string(&path)?.parse() {
            Ok(document) => document,
            Err(e) => {
                errors.push(format!("{name} is not TOML: {}", e.to_string().trim().replace('\n', " ")));
                continue;
            }
        };
        let mut keys = Vec::new();
        collect(&toml::Value::Table(document), String::new(), &mut keys);
        for (field, key) in keys {
            if !known.contains(&key) {
                errors.push(format!("{name}: {field}: source '{key}' is not in {BIBLIOGRAPHY}"));
            }
        }
    }
    Ok(errors)
}

/// Dotted path and key of every string field called `source`.
fn collect(value: &toml::Value, path: String, keys: &mut Vec<(String, String)>) {
    let below = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
    match value {
        toml::Value::Table(table) => {
            for (name, value) in table {
                match value {
                    toml::Value::String(key) if name == "source" => keys.push((path.clone(), key.clone())),
                    value => collect(value, below(name), keys),
                }
            }
        }
        toml::Value::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                collect(item, below(&i.to_string()), keys);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture::folder;
    use super::*;

    const BIB: (&str, &str) =
        (BIBLIOGRAPHY, "@book{oak1999, author = {A. Oak}, title = {Wood}, date = {1999}}");

    fn check_files(files: &[(&str, &str)]) -> Vec<String> {
        check(folder(files).path()).unwrap()
    }

    #[test]
    fn unknown_keys_are_named_with_their_field() {
        let config =
            "[wood]\ndensity = { value = 1.0, source = 'oak1999' }\n[[limb]]\nr = { source = 'elm2000' }";
        assert_eq!(
            check_files(&[BIB, ("configs/paper/x.toml", config)]),
            ["configs/paper/x.toml: limb.0.r: source 'elm2000' is not in docs/references.bib"]
        );
    }

    #[test]
    fn broken_files_are_named() {
        let errors = check_files(&[BIB, ("configs/x.toml", "a = ")]);
        assert!(errors[0].starts_with("configs/x.toml is not TOML"), "{errors:?}");
        let twice = format!("{0}\n{0}", BIB.1);
        let errors = check_files(&[(BIBLIOGRAPHY, &twice)]);
        assert!(errors[0].starts_with("docs/references.bib cannot be parsed"), "{errors:?}");
    }
}
