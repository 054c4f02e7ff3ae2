//! Reference pages, written from the code: options, figures, their sources, metrics, the Python package.

mod configs;
mod options;

use std::path::Path;
use std::process::Stdio;

use anyhow::Context;
use biblatex::ChunksExt;

use super::pages::Pages;
use crate::python::Environment;
use crate::tidy::{metrics, sources};

pub use configs::place as place_of_config;

/// Folder of the reference in the site.
const FOLDER: &str = "reference";
/// Tasks with metrics: name in the code, heading, and page with the definitions.
const TASKS: [(&str, &str, &str); 4] = [
    ("harvest", "Harvest", "../benchmark-v1.md#definitions"),
    ("detect", "Detection", "../benchmark-v1.md#detection-task"),
    ("components", "Reach-and-grasp, gentle interaction", "../benchmark-v1.md#component-tasks"),
    ("verify", "Open-loop verification", "../verify.md"),
];
/// Folder of the Python package.
const PYTHON: &str = "crates/python/python/orchardbench";

/// Adds all reference pages.
///
/// # Errors
///
/// A file that they are made of cannot be read, or the script that reads the Python package fails.
pub fn add(
    root: &Path,
    environment: &Environment,
    developers: clap::Command,
    pages: &mut Pages,
) -> anyhow::Result<()> {
    let mut add = |name: &str, text: String| pages.texts.insert(format!("{FOLDER}/{name}"), text);
    add(
        "orchard.md",
        options::page(
            orchard_program::command_line(),
            "All commands and options of the program `orchard`, as `--help` tells them.",
        ),
    );
    add(
        "xtask.md",
        options::page(
            developers,
            "Commands for developers of this project. Every other command of `cargo xtask` is one of [`orchard`](orchard.md).",
        ),
    );
    add("metrics.md", metrics_page());
    add("sources.md", sources_page(root)?);
    add("python.md", python_page(root, environment)?);
    for (place, text) in configs::pages(root)? {
        pages.texts.insert(place, text);
    }
    Ok(())
}

fn metrics_page() -> String {
    let sections = TASKS.iter().map(|(task, heading, definitions)| {
        let table = metrics::table(task).unwrap_or_default();
        format!("\n## {heading}\n\n[Definitions]({definitions}).\n\n{table}")
    });
    "# Metrics\n\nEvery metric of a result file, with its unit and its two sums: a metric is the sum of a_i over the sum of b_i, i being an episode. Names are those in the files.\n"
        .to_owned()
        + &sections.collect::<String>()
}

/// The bibliography, an entry each under its key.
fn sources_page(root: &Path) -> anyhow::Result<String> {
    let bibliography = sources::bibliography(root)?.map_err(anyhow::Error::msg)?;
    let mut text = "# Sources of figures\n\nEvery figure of the [configs](configs/index.md) names its source by a key of this list ([references.bib](../references.bib)). \
                    [Conventions](../conventions.md#sources-of-constants) counts them.\n"
        .to_owned();
    for entry in bibliography.iter() {
        let field = |name: &str| entry.get(name).map(|text| text.format_verbatim().replace('\n', " "));
        let parts = ["author", "title", "journal", "booktitle", "date", "year", "note", "url"];
        let said: Vec<String> =
            parts.iter().filter_map(|name| field(name)).filter(|text| !text.is_empty()).collect();
        text +=
            &format!("\n## {}\n\n{}.\n", entry.key, options::escaped(said.join(". ").trim_end_matches('.')));
    }
    Ok(text)
}

/// The Python package, read by a script without importing it.
fn python_page(root: &Path, environment: &Environment) -> anyhow::Result<String> {
    let output = environment.script("api.py").arg(root.join(PYTHON)).stdin(Stdio::null()).output();
    let output = output.context("cannot read the Python package")?;
    anyhow::ensure!(output.status.success(), "api.py: {}", String::from_utf8_lossy(&output.stderr).trim());
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
