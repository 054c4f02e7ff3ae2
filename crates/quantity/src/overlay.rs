//! Lays one config table over another.

/// Fields that mark a table as one constant, which is replaced as a whole.
const CONSTANT: [&str; 3] = ["value", "low", "mean"];

/// Lays the table `above` over the table `below`. Tables are merged; constants and plain values replace the old ones.
/// `choices` names the tables of which a config chooses one entry: an entry of another name replaces the whole table.
pub fn overlay(below: &mut toml::Table, above: toml::Table, choices: &[&str]) {
    for (key, value) in above {
        match (below.get_mut(&key), value) {
            (Some(toml::Value::Table(old)), toml::Value::Table(new)) if merges(&key, old, &new, choices) => {
                overlay(old, new, choices);
            }
            (_, value) => {
                below.insert(key, value);
            }
        }
    }
}

fn merges(key: &str, old: &toml::Table, new: &toml::Table, choices: &[&str]) -> bool {
    let constant = CONSTANT.iter().any(|field| new.contains_key(*field));
    let other_choice = choices.contains(&key) && !new.keys().eq(old.keys());
    !constant && !other_choice
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_merge_and_constants_are_replaced() {
        let table = |text: &str| text.parse::<toml::Table>().unwrap();
        let mut below = table("a = { b = { value = 1, unit = 'm' }, c = 2 }\ncamera = { x = { d = 1 } }");
        overlay(&mut below, table("a = { b = { value = 3 } }\ncamera = { y = { e = 1 } }"), &["camera"]);
        assert_eq!(below, table("a = { b = { value = 3 }, c = 2 }\ncamera = { y = { e = 1 } }"));
    }
}
