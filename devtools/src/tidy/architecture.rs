//! Checks that the architecture page names every crate once, lowest first, and no other.

use std::path::Path;

use anyhow::Context;

use super::LAYERS;
use super::crates::Package;

const PAGE: &str = "docs/architecture.md";

/// Reads the page under `root` and compares it with the packages.
pub fn check(root: &Path, packages: &[Package]) -> anyhow::Result<Vec<String>> {
    let text = std::fs::read_to_string(root.join(PAGE)).context(PAGE)?;
    Ok(compare(&text, packages))
}

/// Crate lines are list items that begin with a name in backquotes: "- `name`: sentence".
fn compare(text: &str, packages: &[Package]) -> Vec<String> {
    let mut errors = Vec::new();
    let listed: Vec<&str> = text
        .lines()
        .filter_map(|line| line.strip_prefix("- `")?.split_once('`'))
        .map(|(name, _)| name)
        .collect();
    for package in packages {
        match listed.iter().filter(|name| **name == package.name).count() {
            1 => {}
            0 => errors.push(format!("{PAGE} has no line for crate {}", package.name)),
            n => errors.push(format!("{PAGE} has {n} lines for crate {}", package.name)),
        }
    }
    let exists = |name: &str| packages.iter().any(|p| p.name == name);
    for name in &listed {
        if !exists(name) {
            errors.push(format!("{PAGE} lists `{name}`, which is not a crate"));
        }
    }
    for mention in mentions(text) {
        if !exists(&mention) {
            errors.push(format!("{PAGE} mentions the crate {mention}, which does not exist"));
        }
    }
    let layers: Vec<usize> = listed.iter().filter_map(|name| LAYERS.iter().position(|l| l == name)).collect();
    if !layers.is_sorted() {
        errors.push(format!("{PAGE} does not list the crates lowest first"));
    }
    errors
}

/// Names after `crates/` and `orchard-` anywhere on the page.
fn mentions(text: &str) -> Vec<String> {
    let mut names = Vec::new();
    for prefix in ["crates/", "orchard-"] {
        for (at, _) in text.match_indices(prefix) {
            let rest = &text[at + prefix.len()..];
            let name: String = rest.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
            if !name.is_empty() && !names.contains(&name) {
                names.push(name);
            }
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_page(text: &str) -> Vec<String> {
        let package = |name: &str| Package { name: name.into(), uses: Default::default() };
        compare(text, &[package("spec"), package("treegen")])
    }

    #[test]
    fn a_true_page_passes() {
        assert!(check_page("# Map\n- `spec`: config.\n- `treegen`: trees (`orchard-treegen`).\n").is_empty());
    }

    #[test]
    fn missing_double_dead_and_disordered_lines_are_found() {
        assert_eq!(check_page("- `spec`: config.\n"), ["docs/architecture.md has no line for crate treegen"]);
        assert_eq!(
            check_page("- `spec`: a.\n- `spec`: b.\n- `treegen`: trees.\n"),
            ["docs/architecture.md has 2 lines for crate spec"]
        );
        assert_eq!(
            check_page("- `spec`: a.\n- `treegen`: trees.\n- `gpu`: later.\n"),
            ["docs/architecture.md lists `gpu`, which is not a crate"]
        );
        assert_eq!(
            check_page("- `treegen`: trees.\n- `spec`: a, see crates/viewer.\n"),
            [
                "docs/architecture.md mentions the crate viewer, which does not exist",
                "docs/architecture.md does not list the crates lowest first"
            ]
        );
    }
}
