//! Checks that every `source = "key"` in `configs/` and of the robots exists in `docs/references.bib`.

use std::path::Path;

use anyhow::Context;
use biblatex::Bibliography;

use crate::workspace::{files, relative};

const BIBLIOGRAPHY: &str = "docs/references.bib";

/// A source key in a file of figures.
pub struct Used {
    /// File, and dotted path of the figure in it.
    pub field: String,
    /// The key.
    pub key: String,
}

/// Reads all files of figures and the bibliography under `root`.
pub fn check(root: &Path) -> anyhow::Result<Vec<String>> {
    let bibliography = match bibliography(root)? {
        Ok(bibliography) => bibliography,
        Err(problem) => return Ok(vec![problem]),
    };
    Ok(match used(root)? {
        Err(problems) => problems,
        Ok(used) => used
            .into_iter()
            .filter(|used| bibliography.get(&used.key).is_none())
            .map(|used| format!("{}: source '{}' is not in {BIBLIOGRAPHY}", used.field, used.key))
            .collect(),
    })
}

/// The bibliography, or what is wrong with it.
pub fn bibliography(root: &Path) -> anyhow::Result<Result<Bibliography, String>> {
    let text = std::fs::read_to_string(root.join(BIBLIOGRAPHY)).context(BIBLIOGRAPHY)?;
    Ok(Bibliography::parse(&text).map_err(|e| format!("{BIBLIOGRAPHY} cannot be parsed: {e}")))
}

/// Every source key in `configs/` and of the robots, in the order of files and fields; or which files cannot be read.
pub fn used(root: &Path) -> anyhow::Result<Result<Vec<Used>, Vec<String>>> {
    let (mut all, mut errors) = (Vec::new(), Vec::new());
    let configs = files(&root.join("configs"), &["toml"])?;
    let robots = files(&root.join("assets/robots"), &["toml"])?;
    for path in configs.into_iter().chain(robots) {
        let name = relative(root, &path);
        match std::fs::read_to_string(&path)?.parse::<toml::Table>() {
            Ok(document) => {
                let mut keys = Vec::new();
                collect(&toml::Value::Table(document), String::new(), &mut keys);
                all.extend(
                    keys.into_iter().map(|(field, key)| Used { field: format!("{name}: {field}"), key }),
                );
            }
            Err(e) => errors.push(format!("{name} is not TOML: {}", e.to_string().trim().replace('\n', " "))),
        }
    }
    Ok(if errors.is_empty() { Ok(all) } else { Err(errors) })
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
