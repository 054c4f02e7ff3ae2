//! Pages of the configs: every figure with its value, range, unit and source.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Context;
use toml::Value;

use super::options::escaped;
use crate::workspace::{files, relative};

/// Folders of the checkout with configs, and the folders of their pages in the site.
const FOLDERS: [(&str, &str); 2] =
    [("configs/", "reference/configs/"), ("assets/robots/", "reference/configs/robots/")];
/// Keys of a figure that are not its value.
const ABOUT: [&str; 3] = ["range", "unit", "source"];
/// Length of a value beyond which a page says how many numbers there are.
const LONGEST: usize = 120;

/// Place in the site of a config's page, or of a folder of configs.
pub fn place(file: &str) -> Option<String> {
    if let Some((_, place)) = FOLDERS.iter().find(|(folder, _)| folder.trim_end_matches('/') == file) {
        return Some((*place).to_owned());
    }
    let stem = file.strip_suffix(".toml")?;
    FOLDERS
        .iter()
        .find_map(|(folder, place)| stem.strip_prefix(folder).map(|stem| format!("{place}{stem}.md")))
}

/// The pages of all configs, by place.
pub fn pages(root: &Path) -> anyhow::Result<BTreeMap<String, String>> {
    let mut pages = BTreeMap::new();
    for (folder, _) in FOLDERS {
        for path in files(&root.join(folder), &["toml"])? {
            let name = relative(root, &path);
            let text = std::fs::read_to_string(&path).with_context(|| name.clone())?;
            if let Some(place) = place(&name) {
                let depth = place.matches('/').count() - 1;
                pages.insert(place, page(&name, &text, depth).with_context(|| name.clone())?);
            }
        }
    }
    Ok(pages)
}

/// A page on a config; it lies `depth` folders below the folder of the reference.
fn page(name: &str, text: &str, depth: usize) -> anyhow::Result<String> {
    let document: toml::Table = text.parse()?;
    let mut groups = Vec::new();
    collect(&Value::Table(document), "", &mut groups);
    let comments = comments(text);
    let intro = comments.get("").map_or(String::new(), |said| format!("{}\n\n", escaped(said)));
    let index = format!("{}configs/index.md", "../".repeat(depth));
    let mut page = format!("# {name}\n\n{intro}[All configs]({index})\n\n");
    let sources = format!("{}sources.md", "../".repeat(depth));
    for (path, rows) in groups {
        if !path.is_empty() {
            page += &format!("\n## {path}\n\n");
            page += &comments.get(&path).map_or(String::new(), |said| format!("{}\n\n", escaped(said)));
        }
        page += "| figure | value | unit | range | source | note |\n|---|---|---|---|---|---|\n";
        for (key, value) in rows {
            let full = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            page += &row(&key, &value, comments.get(&full), &sources);
        }
    }
    Ok(page)
}

/// Tables with the entries that are not tables themselves, in the order of the file's names.
fn collect(value: &Value, path: &str, groups: &mut Vec<(String, Vec<(String, Value)>)>) {
    let below = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
    let entries: Vec<(String, &Value)> = match value {
        Value::Table(table) => table.iter().map(|(name, value)| (name.clone(), value)).collect(),
        Value::Array(items) => items.iter().enumerate().map(|(i, value)| (i.to_string(), value)).collect(),
        _ => return,
    };
    let is_group = |value: &Value| match value {
        Value::Table(table) => !is_figure(table),
        Value::Array(items) => {
            items.iter().any(|item| matches!(item, Value::Table(table) if !is_figure(table)))
        }
        _ => false,
    };
    let own = entries.iter().filter(|(_, value)| !is_group(value));
    let own: Vec<(String, Value)> = own.map(|(name, value)| (name.clone(), (*value).clone())).collect();
    if !own.is_empty() {
        groups.push((path.to_owned(), own));
    }
    for (name, value) in entries.iter().filter(|(_, value)| is_group(value)) {
        collect(value, &below(name), groups);
    }
}

/// True for a table that states one figure.
fn is_figure(table: &toml::Table) -> bool {
    ["value", "low", "unit"].iter().any(|key| table.contains_key(*key))
        && !table.values().any(Value::is_table)
}

fn row(key: &str, value: &Value, note: Option<&String>, sources: &str) -> String {
    let figures: Vec<&toml::Table> = match value {
        Value::Table(table) => vec![table],
        Value::Array(items) => items.iter().filter_map(Value::as_table).collect(),
        _ => Vec::new(),
    };
    let each = |name: &str| {
        let mut all: Vec<String> = figures.iter().filter_map(|table| table.get(name)).map(shown).collect();
        all.dedup();
        all.join("; ")
    };
    let shown_value = if figures.is_empty() {
        shown(value)
    } else {
        figures.iter().map(|table| value_of(table)).collect::<Vec<_>>().join("; ")
    };
    let shown_value = if shown_value.len() > LONGEST {
        format!("{} characters, see the file", shown_value.len())
    } else {
        shown_value
    };
    let keys = each("source");
    let keys = keys.split("; ").filter(|key| !key.is_empty()).map(|key| format!("[{key}]({sources}#{key})"));
    let note = note.map_or(String::new(), |note| escaped(note).replace('|', "\\|"));
    format!(
        "| `{key}` | {} | {} | {} | {} | {note} |\n",
        escaped(&shown_value).replace('|', "\\|"),
        escaped(&each("unit")),
        each("range"),
        keys.collect::<Vec<_>>().join(", ")
    )
}

/// The value of a figure: what it states beside range, unit and source.
fn value_of(table: &toml::Table) -> String {
    if let (Some(low), Some(high)) = (table.get("low"), table.get("high")) {
        return format!("{} to {}", shown(low), shown(high));
    }
    let values: Vec<String> = table
        .iter()
        .filter(|(key, _)| !ABOUT.contains(&key.as_str()))
        .map(|(key, value)| if key == "value" { shown(value) } else { format!("{key} {}", shown(value)) })
        .collect();
    values.join(", ")
}

/// A value as text. A range of two numbers is told in words.
fn shown(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(items) => match items.as_slice() {
            [low, high] if !low.is_table() && !low.is_array() => format!("{} to {}", shown(low), shown(high)),
            items => items.iter().map(shown).collect::<Vec<_>>().join(", "),
        },
        Value::Table(table) => value_of(table),
        value => value.to_string(),
    }
}

/// Comments before tables and entries, by dotted path; under the empty path the first of the file.
fn comments(text: &str) -> BTreeMap<String, String> {
    let (mut found, mut said, mut table) = (BTreeMap::new(), Vec::new(), String::new());
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for line in text.lines().map(str::trim) {
        let path = if let Some(comment) = line.strip_prefix('#') {
            said.push(comment.trim().to_owned());
            continue;
        } else if let Some(name) = line.strip_prefix("[[").and_then(|rest| rest.split_once("]]")) {
            let count = counts.entry(name.0.to_owned()).or_default();
            table = format!("{}.{count}", name.0);
            *count += 1;
            table.clone()
        } else if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
            table = name.0.to_owned();
            table.clone()
        } else if let Some((key, _)) = line.split_once('=') {
            if table.is_empty() { key.trim().to_owned() } else { format!("{table}.{}", key.trim()) }
        } else if found.is_empty() && !said.is_empty() {
            String::new()
        } else {
            said.clear();
            continue;
        };
        if !said.is_empty() {
            let path = if found.is_empty() { String::new() } else { path };
            found.insert(path, said.join(" "));
            said.clear();
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: &str = "# About apples.\n# In two lines.\n\npreset = \"paper\"\n\n[fruit]\n# Of a <ripe> one.\nmass = { value = 0.16, range = [0.09, 0.4], unit = \"kg\", source = \"munn\" }\n\
                          ends = { low = 1, high = 2, unit = \"m\", source = \"solver\" }\n\n# Where it hangs.\n[[fruit.site]]\norder = 2\n";

    #[test]
    fn a_config_becomes_tables_of_its_figures() {
        let page = page("configs/x.toml", CONFIG, 1).unwrap();
        assert!(page.starts_with("# configs/x.toml\n\nAbout apples. In two lines.\n\n[All configs](../configs/index.md)\n\n| figure |"), "{page}");
        assert!(
            page.contains(
                "| `mass` | 0.16 | kg | 0.09 to 0.4 | [munn](../sources.md#munn) | Of a &lt;ripe> one. |\n"
            ),
            "{page}"
        );
        assert!(page.contains("| `ends` | 1 to 2 | m |  | [solver](../sources.md#solver) |  |\n"), "{page}");
        assert!(page.contains("\n## fruit.site.0\n\nWhere it hangs.\n\n"), "{page}");
    }

    #[test]
    fn configs_have_places_in_the_site() {
        assert_eq!(place("configs/paper/world.toml").as_deref(), Some("reference/configs/paper/world.md"));
        assert_eq!(place("assets/robots/common.toml").as_deref(), Some("reference/configs/robots/common.md"));
        assert_eq!(place("configs").as_deref(), Some("reference/configs/"));
        assert_eq!(place("Cargo.toml"), None);
    }
}
