//! Links between pages of the checkout, as the site has them.

use std::collections::BTreeMap;
use std::path::Path;

use super::pages::{DOCS, OUTSIDE};
use super::reference::place_of_config;

/// Address of files of the checkout that the site does not hold.
const REPOSITORY: &str = concat!(env!("CARGO_PKG_REPOSITORY"), "/tree/main/");
/// The page of a world in a browser, in the checkout and in the site; and the page that tells of it, which stands in for it where it was not built.
const WORLD: [&str; 3] = ["web/index.html", "world/index.html", "web.md"];

/// Rewrites the links of pages.
pub struct Links<'a> {
    /// The checkout.
    pub root: &'a Path,
    /// Places of all pages and files of the site, with the titles of the pages.
    pub places: BTreeMap<String, Option<String>>,
    /// True if the site holds the world in a browser.
    pub has_world: bool,
}

impl Links<'_> {
    /// A page of the site with its links, which were relative to `source` in the checkout, relative to `place` in the site. Comments, which the site has no
    /// use for, are left out.
    ///
    /// # Errors
    ///
    /// The links that lead nowhere, a line each.
    pub fn rewrite(&self, source: &str, place: &str, text: &str) -> Result<String, Vec<String>> {
        let (mut page, mut errors, mut is_code) = (String::new(), Vec::new(), false);
        for (number, line) in text.lines().enumerate() {
            is_code ^= line.trim_start().starts_with("```");
            let is_comment = line.trim_start().starts_with("<!--") && line.trim_end().ends_with("-->");
            match self.of_line(source, place, line) {
                _ if is_code => page += line,
                // Within a list a blank line would end it.
                _ if is_comment && line.starts_with(' ') => continue,
                _ if is_comment => {}
                Ok(line) => page += &line,
                Err(target) => errors.push(format!("{source}:{}: {target} leads nowhere", number + 1)),
            }
            page.push('\n');
        }
        if errors.is_empty() { Ok(page) } else { Err(errors) }
    }

    fn of_line(&self, source: &str, place: &str, line: &str) -> Result<String, String> {
        let mut new = String::new();
        let mut rest = line;
        while let Some((before, after)) = rest.split_once("](") {
            let Some((target, after)) = after.split_once(')') else { break };
            let (target, title) = self.target(source, place, target)?;
            new += &match before.rsplit_once('[') {
                Some((head, words)) => {
                    // A page that is called by its file's name in the checkout has its title in the site.
                    let words = title.filter(|_| words.ends_with(".md")).unwrap_or(words.to_owned());
                    format!("{head}[{words}]({target})")
                }
                // The end of a link around a picture, which is written already.
                None => format!("{before}]({target})"),
            };
            rest = after;
        }
        Ok(new + rest)
    }

    /// Target of a link in the site, and the title of the page that it leads to.
    fn target(&self, source: &str, place: &str, target: &str) -> Result<(String, Option<String>), String> {
        let is_elsewhere = target.contains("://") || target.starts_with("mailto:") || target.starts_with('#');
        if is_elsewhere || source.is_empty() {
            return Ok((target.to_owned(), None));
        }
        let (file, anchor) =
            target.split_once('#').map_or((target, String::new()), |(file, a)| (file, format!("#{a}")));
        let folder = source.rsplit_once('/').map_or("", |(folder, _)| folder);
        let file = normal(&format!("{folder}/{file}"));
        let here = |there: &str| format!("{}{anchor}", relative(place, there));
        if let Some(there) = self.in_site(&file) {
            return Ok((here(&there), self.places.get(&there).cloned().flatten()));
        }
        if self.root.join(&file).exists() {
            return Ok((format!("{REPOSITORY}{file}{anchor}"), None));
        }
        Err(target.to_owned())
    }

    /// Place in the site of a file or folder of the checkout, if it has one.
    fn in_site(&self, file: &str) -> Option<String> {
        if file == WORLD[0] {
            return Some(WORLD[if self.has_world { 1 } else { 2 }].to_owned());
        }
        let outside = OUTSIDE.iter().find(|(path, _)| *path == file).map(|(_, place)| (*place).to_owned());
        let inside = file.strip_prefix(&format!("{DOCS}/")).map(|file| file.to_owned());
        let place = outside.or(inside).or_else(|| place_of_config(file))?;
        let index = format!("{}/index.md", place.trim_end_matches('/'));
        [place, index].into_iter().find(|place| self.places.contains_key(place))
    }
}

/// A path without `.` and `..`.
fn normal(path: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()),
            part => parts.push(part),
        }
    }
    parts.join("/")
}

/// A place relative to a page.
fn relative(page: &str, place: &str) -> String {
    let depth = page.matches('/').count();
    format!("{}{place}", "../".repeat(depth))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_lead_to_the_site_or_to_the_repository() {
        let root = crate::workspace::root();
        let places = ["overview.md", "robots.md", "decisions/index.md", "reference/configs/paper/world.md"];
        let places =
            places.map(|place| (place.to_owned(), Some(format!("Of {place}")))).into_iter().collect();
        let links = Links { root: &root, places, has_world: false };
        let page = "[a](../../README.md#x) [robots.md](../robots.md) [c](https://c.org/) ![d](../decisions/)\n<!-- e -->\n  <!-- e -->\n[f](../../configs/paper/world.toml)\n\
                    [g](../../Cargo.toml) [![h](../../web/index.html)](../robots.md)\n```\n[i](nothing)\n```\n";
        let site = links.rewrite("docs/computation/x.md", "computation/x.md", page).unwrap();
        let expected = format!(
            "[a](../overview.md#x) [Of robots.md](../robots.md) [c](https://c.org/) ![d](../decisions/index.md)\n\n[f](../reference/configs/paper/world.md)\n\
             [g]({REPOSITORY}Cargo.toml) [![h](../web.md)](../robots.md)\n```\n[i](nothing)\n```\n"
        );
        assert_eq!(site, expected);
        let errors = links.rewrite("docs/x.md", "x.md", "\n[a](nothing.md#b)").unwrap_err();
        assert_eq!(errors, ["docs/x.md:2: nothing.md#b leads nowhere"]);
    }
}
