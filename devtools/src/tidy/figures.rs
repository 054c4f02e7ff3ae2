//! The pages that say how many figures come from which source count them as they are.

use std::collections::BTreeMap;
use std::path::Path;

use biblatex::{Bibliography, ChunksExt};

use super::{marked, sources};

/// Name of the part in both pages.
const PART: &str = "figures by source";
/// Author of the keys that stand for a choice of this project.
const OURSELVES: &str = "OrchardBench in Rust";
/// Keys of the paper and of its released code.
const PAPER: [&str; 2] = ["orchardbench", "orchardbench_release"];

/// Compares both pages with the files; with `write`, brings them up to date instead.
pub fn check(root: &Path, write: bool) -> anyhow::Result<Vec<String>> {
    let Ok(bibliography) = sources::bibliography(root)? else {
        return Ok(Vec::new()); // `sources` reports it
    };
    let Ok(used) = sources::used(root)? else {
        return Ok(Vec::new());
    };
    let count = Count::new(&bibliography, used.into_iter().map(|used| used.key));
    let mut errors = marked::keep(root, "README.md", PART, &count.sentence(), write)?;
    errors.extend(marked::keep(root, "docs/conventions.md", PART, &count.tables(), write)?);
    Ok(errors)
}

/// Figures by source.
#[derive(Default)]
struct Count {
    /// Per key of our own: figures, and what the key stands for.
    own: BTreeMap<String, (usize, String)>,
    /// From the paper, and from its released code.
    paper: [usize; PAPER.len()],
    /// From measurements, datasheets and textbooks.
    published: usize,
}

impl Count {
    fn new(bibliography: &Bibliography, keys: impl Iterator<Item = String>) -> Self {
        let mut count = Self::default();
        for key in keys {
            let text = |field: &str| {
                let entry = bibliography.get(&key);
                entry
                    .and_then(|entry| entry.get(field))
                    .map(|text| text.format_verbatim())
                    .unwrap_or_default()
            };
            if let Some(i) = PAPER.iter().position(|name| *name == key) {
                count.paper[i] += 1;
            } else if text("author").contains(OURSELVES) {
                let note = text("note");
                count.own.entry(key).or_insert((0, note)).0 += 1;
            } else {
                count.published += 1;
            }
        }
        count
    }

    fn total_own(&self) -> usize {
        self.own.values().map(|(n, _)| n).sum()
    }

    fn total_paper(&self) -> usize {
        self.paper.iter().sum()
    }

    fn total(&self) -> usize {
        self.total_own() + self.total_paper() + self.published
    }

    /// A number with its share of all figures.
    fn share(&self, n: usize) -> String {
        format!("{n} ({:.0} %)", 100.0 * n as f64 / self.total().max(1) as f64)
    }

    /// The README's sentence.
    fn sentence(&self) -> String {
        format!(
            "  Of {} figures, {} are choices or fits of this project and are marked as such,\n  {} come from the paper or its released code, \
             and {} from published measurements, datasheets and textbooks\n  \
             ([how they are counted](docs/conventions.md#sources-of-constants)).\n  ",
            self.total(),
            self.share(self.total_own()),
            self.share(self.total_paper()),
            self.share(self.published)
        )
    }

    /// The tables of the page on conventions.
    fn tables(&self) -> String {
        let mut text = format!(
            "\nIn this version {} figures have a source:\n\n| source | figures |\n|---|---|\n| this project's own | {} |\n\
             | the paper (`{}`, {}) and its released code (`{}`, {}) | {} |\n| measurements, datasheets, textbooks | {} |\n\n\
             | key of our own | figures | for |\n|---|---|---|\n",
            self.total(),
            self.share(self.total_own()),
            PAPER[0],
            self.paper[0],
            PAPER[1],
            self.paper[1],
            self.share(self.total_paper()),
            self.share(self.published)
        );
        let mut keys: Vec<_> = self.own.iter().collect();
        keys.sort_by_key(|(key, (figures, _))| (std::cmp::Reverse(*figures), *key));
        for (key, (figures, note)) in keys {
            text += &format!("| `{key}` | {figures} | {note} |\n");
        }
        text + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture::folder;
    use super::*;

    #[test]
    fn figures_are_counted_by_who_states_them() {
        let part = format!("<!-- {PART} -->\n<!-- end of {PART} -->\n");
        let bib = "@misc{tuned, author = {{OrchardBench in Rust}}, title = {T}, note = {Tuned by us}}\n\
                   @misc{orchardbench, author = {Munn}, title = {P}}\n@book{oak1999, author = {A. Oak}, title = {Wood}}";
        let config = "a = { value = 1.0, source = 'tuned' }\nb = { value = 2.0, source = 'tuned' }\n\
                      [c]\nd = { values = [1.0, 2.0], source = 'orchardbench' }\n[[e]]\nf = { value = 1, source = 'oak1999' }";
        let folder = folder(&[
            ("docs/references.bib", bib),
            ("configs/x.toml", config),
            ("assets/robots/r/robot.toml", "m = { value = 1.0, source = 'oak1999' }"),
            ("README.md", &part),
            ("docs/conventions.md", &part),
        ]);
        assert_eq!(check(folder.path(), false).unwrap().len(), 2);
        assert!(check(folder.path(), true).unwrap().is_empty());
        let readme = std::fs::read_to_string(folder.path().join("README.md")).unwrap();
        assert!(
            readme.contains("Of 5 figures, 2 (40 %) are choices")
                && readme.contains("1 (20 %) come from the paper"),
            "{readme}"
        );
        let page = std::fs::read_to_string(folder.path().join("docs/conventions.md")).unwrap();
        assert!(page.contains("| `tuned` | 2 | Tuned by us |"), "{page}");
        assert!(check(folder.path(), false).unwrap().is_empty());
    }
}
