//! Largest counts that a program takes, whatever range a config file states for itself.
//!
//! A config file states the range of each of its values, so a file could allow itself any count, and a count decides how much memory is
//! taken. The limit of a count is the upper end of its range in the configs that come with the program.

use std::collections::BTreeMap;

use serde::Serialize;
use toml::Value;

/// Largest counts, by their path in a config.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CountLimits(BTreeMap<String, i64>);

/// Fields of a constant that hold a value.
const VALUES: [&str; 3] = ["value", "low", "high"];

impl CountLimits {
    /// Limits by configs: for each count the largest end of its range.
    pub fn of<T: Serialize>(configs: &[T]) -> Self {
        let mut limits = Self::default();
        for config in configs {
            // A config that is no TOML has no counts.
            let Ok(tree) = Value::try_from(config) else { continue };
            walk(&tree, "", &mut |path, constant| {
                if let Some(Value::Integer(end)) = constant.get("range").and_then(|range| range.get(1)) {
                    let limit = limits.0.entry(path.to_owned()).or_insert(*end);
                    *limit = (*limit).max(*end);
                }
            });
        }
        limits
    }

    /// Returns the first count of a config that is larger than its limit: its path, and the problem.
    pub fn problem(&self, config: &impl Serialize) -> Option<(String, String)> {
        let tree = match Value::try_from(config) {
            Ok(tree) => tree,
            Err(e) => return Some((".".to_owned(), e.to_string())),
        };
        let mut found = None;
        walk(&tree, "", &mut |path, constant| {
            let Some(limit) = self.0.get(path) else { return };
            let values = VALUES.iter().filter_map(|name| constant.get(*name)?.as_integer());
            if let Some(value) = values.into_iter().find(|value| value > limit) {
                let problem = format!("{value} is more than {limit}, the most that this program takes");
                found.get_or_insert((path.to_owned(), problem));
            }
        });
        found
    }
}

/// Calls a function with every constant and its path. Entries of a list share the list's path.
fn walk(value: &Value, path: &str, visit: &mut impl FnMut(&str, &toml::Table)) {
    match value {
        Value::Table(table) if matches!(table.get("range"), Some(Value::Array(_))) => visit(path, table),
        Value::Table(table) => {
            for (key, value) in table {
                let below = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                walk(value, &below, visit);
            }
        }
        Value::Array(list) => list.iter().for_each(|value| walk(value, path, visit)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Count, Quantity, from_toml};
    use serde::Deserialize;

    #[derive(Serialize, Deserialize)]
    struct Doc {
        cells: Count,
        width: Quantity,
        sizes: Vec<Count>,
    }

    fn doc(cells: &str, width: &str, size: &str) -> Doc {
        let text = format!(
            "cells = {{ {cells}, unit = 'cells', source = 'x' }}\nwidth = {{ {width}, unit = 'm', source = 'x' }}\n\
             sizes = [{{ value = 1, range = [0, 5], unit = 'a', source = 'x' }}, {{ {size}, unit = 'a', source = 'x' }}]"
        );
        from_toml("x.toml", &text).unwrap()
    }

    #[test]
    fn a_file_cannot_raise_a_count_over_the_programs_range() {
        let limits = CountLimits::of(&[
            doc("value = 3, range = [1, 10]", "value = 2, range = [0, 4]", "value = 1, range = [0, 5]"),
            doc("value = 3, range = [1, 20]", "value = 2, range = [0, 4]", "value = 1, range = [0, 5]"),
        ]);
        let wide = "value = 1e9, range = [0, 1e9]";
        assert_eq!(
            limits.problem(&doc("value = 20, range = [0, 4000000000]", wide, "value = 5, range = [0, 9]")),
            None
        );
        let (path, problem) = limits
            .problem(&doc("value = 21, range = [0, 4000000000]", wide, "value = 5, range = [0, 9]"))
            .unwrap();
        assert_eq!((&*path, &*problem), ("cells", "21 is more than 20, the most that this program takes"));
        let (path, _) =
            limits.problem(&doc("value = 1, range = [0, 9]", wide, "value = 6, range = [0, 9]")).unwrap();
        assert_eq!(path, "sizes");
    }
}
