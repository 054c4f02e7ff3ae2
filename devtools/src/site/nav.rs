//! The navigation of the site, and what is made from it.

use anyhow::Context;
use toml::Value;

use super::pages::{Pages, first_sentence, plain, title};

/// The generator's config with the navigation.
pub struct Nav {
    /// The config as it is.
    pub config: String,
    name: String,
    description: String,
    /// Sections with the places of their pages, in order. A page outside of all sections has a section without a name.
    sections: Vec<(String, Vec<String>)>,
}

impl Nav {
    /// Reads a config.
    ///
    /// # Errors
    ///
    /// It is not TOML, or lacks name, description or navigation.
    pub fn read(config: &str) -> anyhow::Result<Self> {
        let document: toml::Table = config.parse()?;
        let project = document.get("project").and_then(Value::as_table).context("no table [project]")?;
        let text = |name: &str| {
            project
                .get(name)
                .and_then(Value::as_str)
                .map(str::to_owned)
                .with_context(|| format!("no project.{name}"))
        };
        let nav = project.get("nav").and_then(Value::as_array).context("no project.nav")?;
        let mut sections = Vec::new();
        for entry in nav {
            let named = entry.as_table().and_then(|table| table.iter().next());
            let (name, value) = named.map_or((String::new(), entry), |(name, value)| (name.clone(), value));
            let mut places = Vec::new();
            collect(value, &mut places);
            sections.push((if value.is_str() { String::new() } else { name }, places));
        }
        Ok(Self {
            config: config.to_owned(),
            name: text("site_name")?,
            description: text("site_description")?,
            sections,
        })
    }

    /// Pages without an entry, entries without a page, and pages without a title. The page `index.md` of a folder stands for the pages beside it.
    pub fn problems(&self, pages: &Pages) -> Vec<String> {
        let places: Vec<&String> = self.sections.iter().flat_map(|(_, places)| places).collect();
        let missing = places.iter().filter(|place| !pages.texts.contains_key(**place));
        let missing = missing.map(|place| format!("docs/zensical.toml: no page {place}"));
        let folders: Vec<&str> = places
            .iter()
            .filter_map(|place| place.strip_suffix("index.md"))
            .filter(|f| !f.is_empty())
            .collect();
        let is_led_to = |place: &String| {
            places.contains(&place) || folders.iter().any(|folder| place.starts_with(folder))
        };
        let lost = pages.texts.keys().filter(|place| !is_led_to(place));
        let lost = lost.map(|place| format!("docs/zensical.toml: the navigation lacks {place}"));
        let untitled = pages.texts.iter().filter(|(_, text)| title(text) == "Untitled");
        let untitled = untitled.map(|(place, _)| format!("{place}: a page needs a title (`# ...`)"));
        missing.chain(lost).chain(untitled).collect()
    }

    /// The list of all pages of the navigation, as language models look for it (<https://llmstxt.org>): title, place and first sentence.
    pub fn for_language_models(&self, pages: &Pages) -> String {
        let mut text = format!("# {}\n\n> {}\n", self.name, self.description);
        for (name, places) in &self.sections {
            text += &format!("\n## {}\n\n", if name.is_empty() { "First" } else { name });
            for place in places {
                let page = pages.texts.get(place).map_or("", String::as_str);
                text += &format!("- [{}]({place}): {}\n", title(page), plain(&first_sentence(page)));
            }
        }
        text
    }
}

/// Places of the pages in an entry of the navigation.
fn collect(value: &Value, places: &mut Vec<String>) {
    match value {
        Value::String(place) => places.push(place.clone()),
        Value::Array(entries) => entries.iter().for_each(|entry| collect(entry, places)),
        Value::Table(table) => table.values().for_each(|entry| collect(entry, places)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: &str = "[project]\nsite_name = 'Orchard'\nsite_description = 'Apples.'\nnav = ['index.md', { 'Use' = ['a.md', { 'B' = 'b/index.md' }] }]\n";

    fn pages(places: &[&str]) -> Pages {
        let text = |place: &&str| ((*place).to_owned(), format!("# {place}\n\nA page. More.\n"));
        Pages { texts: places.iter().map(text).collect(), ..Pages::default() }
    }

    #[test]
    fn every_page_is_in_the_navigation_once() {
        let nav = Nav::read(CONFIG).unwrap();
        assert_eq!(nav.problems(&pages(&["index.md", "a.md", "b/index.md", "b/c.md"])), Vec::<String>::new());
        let problems = nav.problems(&pages(&["index.md", "b/index.md", "d.md"]));
        assert_eq!(
            problems,
            ["docs/zensical.toml: no page a.md", "docs/zensical.toml: the navigation lacks d.md"]
        );
        assert!(Nav::read("[project]\nsite_name = 'x'").is_err());
    }

    #[test]
    fn language_models_get_a_list() {
        let nav = Nav::read(CONFIG).unwrap();
        let text = nav.for_language_models(&pages(&["index.md", "a.md", "b/index.md"]));
        assert!(
            text.starts_with(
                "# Orchard\n\n> Apples.\n\n## First\n\n- [index.md](index.md): A page.\n\n## Use\n"
            ),
            "{text}"
        );
    }
}
