//! The blocks of the tutorials, run as the pages have them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::Context;
use orchard_program::Failure;

use crate::python::{self, Environment};
use crate::site::{self, SUITE};
use crate::workspace;

/// Folder of the tutorials, and a tutorial beside it.
const FOLDER: &str = "docs/tutorials";
const BESIDE: &str = "docs/robots.md";
/// Folder of the checkout that every tutorial begins with.
const EXAMPLES: &str = "examples";
/// Begins the line above a block that is not run; the reason follows.
const NOT_RUN: &str = "Our checks do not run this block";

/// A block of code on a page.
#[derive(Debug, PartialEq)]
struct Block {
    /// Line of its first fence, from 1.
    line: usize,
    /// First word of its fence.
    language: String,
    /// File that it shows or makes.
    title: Option<String>,
    text: String,
    is_run: bool,
}

/// Programs that tutorials call.
pub struct Programs {
    /// The search path that finds them.
    path: String,
    /// Folder of the Python package.
    package: PathBuf,
}

impl Programs {
    /// Puts `orchard`, `python` and a stand-in for `cargo` in front of the search path.
    pub fn install(environment: &Environment, package: &Path) -> Result<Self, Failure> {
        let folder = python::folder(SUITE).join("programs");
        let debug = workspace::target().join("debug");
        stand_in(&folder, &debug).map_err(|e| Failure::Failed(format!("{e:#}")))?;
        let rest = std::env::var("PATH").unwrap_or_default();
        let first =
            [folder.as_path(), debug.as_path(), environment.programs()].map(|p| p.display().to_string());
        Ok(Self { path: format!("{}:{rest}", first.join(":")), package: package.to_owned() })
    }
}

/// Writes a `cargo` that knows `cargo run --release -- ...` alone: it runs examples/own-controller, built with the tests.
fn stand_in(folder: &Path, debug: &Path) -> anyhow::Result<()> {
    let example = debug.join("tutorial-controller");
    let script = format!(
        "#!/bin/sh\n[ \"$1 $2 $3\" = \"run --release --\" ] || {{ echo \"tutorials may call only: cargo run --release -- ...\" >&2; exit 1; }}\n\
         shift 3\nexec '{}' \"$@\"\n",
        example.display()
    );
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let file = folder.join("cargo");
    fs::write(&file, script).with_context(|| file.display().to_string())?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(&file, fs::Permissions::from_mode(0o755))
            .with_context(|| file.display().to_string())?;
    }
    Ok(())
}

/// Runs the blocks of all tutorials whose names contain a text; returns the number of blocks.
pub fn run(root: &Path, programs: &Programs, only: Option<&str>) -> Result<usize, Failure> {
    let failed = |e: anyhow::Error| Failure::Failed(format!("{e:#}"));
    let mut pages = workspace::files(&root.join(FOLDER), &["md"]).map_err(failed)?;
    pages.push(root.join(BESIDE));
    let mut count = 0;
    for path in pages {
        let name = workspace::relative(root, &path);
        if only.is_some_and(|only| !name.contains(only)) {
            continue;
        }
        let text = fs::read_to_string(&path).map_err(|e| Failure::Failed(format!("{name}: {e}")))?;
        let stem = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
        let folder = python::folder(SUITE).join("tutorials").join(stem);
        fresh(root, &folder).map_err(failed)?;
        let start = Instant::now();
        let mut said = String::new();
        for block in blocks(&text).iter().filter(|block| block.is_run) {
            let at = |e: anyhow::Error| Failure::Failed(format!("{name}:{}: {e:#}", block.line));
            count += usize::from(execute(root, &folder, block, programs, &mut said).map_err(at)?);
        }
        say!("{name}: {:.1} s", start.elapsed().as_secs_f64());
    }
    if count == 0 {
        return Err(Failure::BadInput(format!(
            "no tutorial of {FOLDER} has blocks to run for {:?}",
            only.unwrap_or_default()
        )));
    }
    Ok(count)
}

/// Makes a folder that holds the examples and nothing else.
fn fresh(root: &Path, folder: &Path) -> anyhow::Result<()> {
    site::remove(folder)?;
    site::copy(&root.join(EXAMPLES), &folder.join(EXAMPLES))
}

/// Writes, runs or compares a block, `said` being what the last one that ran has printed; false if there is nothing to do.
fn execute(
    root: &Path,
    folder: &Path,
    block: &Block,
    programs: &Programs,
    said: &mut String,
) -> anyhow::Result<bool> {
    if let Some(title) = &block.title {
        let original = root.join(title);
        if original.is_file() {
            let text = fs::read_to_string(&original)?;
            anyhow::ensure!(text == block.text, "the block differs from {title}");
            return Ok(true);
        }
        let file = folder.join(title);
        fs::create_dir_all(file.parent().unwrap_or(folder))?;
        fs::write(&file, &block.text).with_context(|| title.clone())?;
        return Ok(true);
    }
    let mut command = match block.language.as_str() {
        "sh" => {
            let mut shell = Command::new("sh");
            shell.args(["-e", "-c", &block.text]);
            shell
        }
        "python" => {
            let mut python = Command::new("python");
            python.args(["-c", &block.text]);
            python
        }
        "text" => {
            let other = block.text.lines().find(|line| !said.contains(line.trim()));
            anyhow::ensure!(other.is_none(), "the command above does not print {other:?}, but:\n{said}");
            return Ok(true);
        }
        _ => return Ok(false),
    };
    command.current_dir(folder).env("PATH", &programs.path).env("PYTHONPATH", &programs.package);
    let output = command.stdin(Stdio::null()).output().context("cannot run the block")?;
    let printed = [output.stdout, output.stderr].concat();
    *said = String::from_utf8_lossy(&printed).into_owned();
    anyhow::ensure!(output.status.success(), "ended with {}\n{}{said}", output.status, block.text);
    Ok(true)
}

/// The blocks of a page, in their order.
fn blocks(page: &str) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    let mut is_open = false;
    let mut above = "";
    for (i, line) in page.lines().enumerate() {
        match (line.strip_prefix("```"), is_open) {
            (Some(_), true) => is_open = false,
            (Some(info), false) => {
                is_open = true;
                let title = info.split_once("title=\"").and_then(|(_, rest)| rest.split_once('"'));
                found.push(Block {
                    line: i + 1,
                    language: info.split_whitespace().next().unwrap_or_default().to_owned(),
                    title: title.map(|(title, _)| title.to_owned()),
                    text: String::new(),
                    is_run: !above.starts_with(NOT_RUN),
                });
            }
            (None, true) => {
                if let Some(block) = found.last_mut() {
                    block.text += &format!("{line}\n");
                }
            }
            (None, false) if !line.trim().is_empty() => above = line,
            (None, false) => {}
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_found_with_what_is_to_be_done() {
        let page = "# A\n\n```sh\nls\n\npwd\n```\n\n```toml title=\"a/b.toml\"\nx = 1\n```\nOur checks do not run this block: it needs a cluster.\n\n```sh\nsbatch\n```\nText.\n\n```text\nout\n```\n";
        let blocks = blocks(page);
        let told: Vec<(&str, Option<&str>, &str, bool)> = blocks
            .iter()
            .map(|b| (b.language.as_str(), b.title.as_deref(), b.text.as_str(), b.is_run))
            .collect();
        assert_eq!(
            told,
            [
                ("sh", None, "ls\n\npwd\n", true),
                ("toml", Some("a/b.toml"), "x = 1\n", true),
                ("sh", None, "sbatch\n", false),
                ("text", None, "out\n", true)
            ]
        );
        assert_eq!(blocks[2].line, 14);
    }
}
