//! Pages of the site in Markdown, with the files that they show.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context;

use crate::workspace;

/// Folder of the documentation in the checkout.
pub const DOCS: &str = "docs";
/// Pages of the checkout outside of that folder, and their places in the site.
pub const OUTSIDE: [(&str, &str); 2] = [("README.md", "overview.md"), ("CHANGELOG.md", "changelog.md")];
/// Kinds of files that pages show or offer.
const FILES: [&str; 6] = ["png", "svg", "bib", "ipynb", "css", "js"];

/// Pages and files of a site. Places are relative to the site, with forward slashes.
#[derive(Debug, Default)]
pub struct Pages {
    /// Markdown by place.
    pub texts: BTreeMap<String, String>,
    /// Files that are copied, by place.
    pub files: BTreeMap<String, PathBuf>,
}

impl Pages {
    /// Reads all pages and files of the documentation under a root.
    ///
    /// # Errors
    ///
    /// A file cannot be read.
    pub fn read(root: &Path) -> anyhow::Result<Self> {
        let docs = root.join(DOCS);
        let mut pages = Self::default();
        let own = workspace::files(&docs, &["md"])?;
        let own = own.into_iter().map(|path| (workspace::relative(&docs, &path), path));
        let outside = OUTSIDE.iter().map(|(file, place)| ((*place).to_owned(), root.join(file)));
        for (place, path) in own.chain(outside) {
            let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
            pages.texts.insert(place, text);
        }
        for path in workspace::files(&docs, &FILES)? {
            pages.files.insert(workspace::relative(&docs, &path), path);
        }
        Ok(pages)
    }

    /// Adds a page with a list of its pages to every folder that has none.
    pub fn add_indexes(&mut self, titles: &[(&str, &str)]) {
        for (folder, intro) in titles {
            let within = |place: &&String| place.starts_with(&format!("{folder}/"));
            let rows = self.texts.keys().filter(within).map(|place| {
                let text = &self.texts[place];
                let name = &place[folder.len() + 1..];
                format!("- [{}]({name}): {}\n", title(text), plain(&first_sentence(text)))
            });
            let page = format!("{intro}\n\n{}", rows.collect::<String>());
            self.texts.insert(format!("{folder}/index.md"), page);
        }
    }
}

/// Title of a page: its first heading.
pub fn title(text: &str) -> String {
    let heading = text.lines().find_map(|line| line.strip_prefix("# "));
    heading.unwrap_or("Untitled").trim().to_owned()
}

/// The first sentence of a page: of its first paragraph that is neither heading, picture, list, quote, table nor code.
pub fn first_sentence(text: &str) -> String {
    let mut is_code = false;
    let mut paragraph = String::new();
    for line in text.lines().skip_while(|line| !line.starts_with("# ")) {
        is_code ^= line.starts_with("```");
        let is_other = is_code
            || line.trim().is_empty()
            || line.starts_with("```")
            || line.starts_with(['#', '!', '<', '|', '-', '>']);
        match (is_other, paragraph.is_empty()) {
            (true, true) => {}
            (true, false) => break,
            (false, _) => paragraph += &format!("{} ", line.trim()),
        }
    }
    // Some paragraphs begin with a word that names them, as in **Context.**
    let named = paragraph.strip_prefix("**").and_then(|rest| rest.split_once(".** "));
    let paragraph = named.map_or(paragraph.as_str(), |(_, rest)| rest);
    let end = paragraph.find(". ").map_or(paragraph.len(), |at| at + 1);
    paragraph[..end].trim().to_owned()
}

/// A sentence without links, which are relative to its page.
pub fn plain(sentence: &str) -> String {
    let mut plain = String::new();
    let mut rest = sentence;
    while let Some((before, after)) = rest.split_once("](") {
        let Some((_, after)) = after.split_once(')') else { break };
        let (head, word) = before.rsplit_once('[').unwrap_or((before, ""));
        plain += &format!("{head}{word}");
        rest = after;
    }
    plain + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_described_by_its_first_sentence() {
        let page = "# Trees\n\n![a tree](tree.png)\n\n```sh\norchard x. y\n```\n\n`grow` makes [one\ntree](a.md) of wood. It stands.\n";
        assert_eq!(title(page), "Trees");
        assert_eq!(plain(&first_sentence(page)), "`grow` makes one tree of wood.");
        assert_eq!(first_sentence("# A\n"), "");
        assert_eq!(first_sentence("# A\n\n**Context.** It is so. Now.\n"), "It is so.");
    }

    #[test]
    fn a_folder_gets_a_list_of_its_pages() {
        let mut pages = Pages::default();
        pages.texts.insert("a/x.md".into(), "# X\n\nA letter. Another.\n".into());
        pages.add_indexes(&[("a", "# Letters")]);
        assert_eq!(pages.texts["a/index.md"], "# Letters\n\n- [X](x.md): A letter.\n");
    }
}
