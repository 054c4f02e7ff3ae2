//! `cargo xtask site`: builds the documentation site.

mod links;
mod nav;
pub mod pages;
mod reference;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::CommandFactory;
use orchard_bench::store::write_bytes;
use orchard_program::Failure;

use crate::python::{self, Environment};
use crate::workspace;
use links::Links;
use nav::Nav;
use pages::{DOCS, OUTSIDE, Pages, title};

/// Builds the documentation site from docs/ and from the code.
#[derive(clap::Args)]
#[command(
    after_help = "Pages are those of docs/, README.md and CHANGELOG.md, and reference pages written from the code: options, configs with units and sources, metrics, the Python\n\
                  package. docs/zensical.toml holds the navigation. A link, an anchor or a picture that is not there fails the build.\n\n\
                  Files:\n  DIR/VERSION/          the site of one version, with search and llms.txt; each page lies beside its HTML as Markdown, too\n  \
                  DIR/versions.json     the versions in DIR, for the selector on each page: build several versions into one folder\n  \
                  DIR/index.html        leads to the newest version\n\n\
                  Examples:\n  cargo xtask site --out site && python3 -m http.server --directory site    # for a look: http://localhost:8000\n  \
                  cargo xtask web --out page && cargo xtask site --world page               # with a world in the browser behind its first page\n\n\
                  Needs python3 with venv, and the network on the first run: Zensical goes into target/site/venv. Takes ten seconds after that."
)]
pub struct Args {
    /// Folder of the site, made if it is missing; the version is replaced in it
    #[arg(long, value_name = "DIR", default_value = "site")]
    out: PathBuf,
    /// Name of the version, such as 1.2.0 or dev
    #[arg(long, value_name = "NAME", default_value = env!("CARGO_PKG_VERSION"), value_parser = version)]
    version: String,
    /// Folder that `cargo xtask web` wrote: the site gets the page, and its first page leads to it
    #[arg(long, value_name = "DIR")]
    world: Option<PathBuf>,
}

/// Folder of the scripts, of the environment and of what the generator reads and writes.
pub const SUITE: &str = "site";
/// The generator's package.
const GENERATOR: &str = "zensical";
/// Config of the site, in the folder of the documentation; it holds the navigation.
const CONFIG: &str = "zensical.toml";
/// The file that lists the versions, as the selector on the pages reads it.
const VERSIONS: &str = "versions.json";
/// The list of pages for language models.
const LIST: &str = "llms.txt";
/// Folder of the world in a browser within the site.
const WORLD: &str = "world";

fn version(text: &str) -> Result<String, String> {
    let fits = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    let is_name = !text.is_empty() && text.chars().all(fits) && !text.starts_with(['.', '-']);
    is_name
        .then(|| text.to_owned())
        .ok_or_else(|| "must be letters, digits, `.`, `_` and `-`, as in 1.2.0 or dev".to_owned())
}

pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(world) = args.world.as_ref().filter(|world| !world.join("index.html").is_file()) {
        let problem = format!(
            "--world {}: no index.html in it; `cargo xtask web --out {0}` writes the page",
            world.display()
        );
        return Err(Failure::BadInput(problem));
    }
    let there = args.out.join(&args.version);
    if std::fs::read_dir(&there).is_ok_and(|mut files| files.next().is_some()) && !there.join(LIST).is_file()
    {
        let problem = format!(
            "{}: is there and holds no site ({LIST} is missing): choose another --out or --version",
            there.display()
        );
        return Err(Failure::BadInput(problem));
    }
    eprintln!("1 of 4: the generator");
    let environment = Environment::install(SUITE).map_err(|reason| {
        Failure::BadInput(format!("the site needs python3 with venv, and the network once: {reason}"))
    })?;
    let site = build(&environment, args.world.as_deref(), &args.out, &args.version)?;
    say!(
        "{}: {} pages; to look at it: python3 -m http.server --directory {}",
        site.folder.display(),
        site.pages,
        args.out.display()
    );
    Ok(())
}

/// A site that was built.
pub struct Site {
    /// Folder of its version.
    pub folder: PathBuf,
    /// Number of its pages.
    pub pages: usize,
}

/// Builds a version of the site into a folder.
///
/// # Errors
///
/// A link leads nowhere, a page is not in the navigation, the generator refuses something, or a file cannot be read or written.
pub fn build(
    environment: &Environment,
    world: Option<&Path>,
    out: &Path,
    version: &str,
) -> Result<Site, Failure> {
    let root = workspace::root();
    let stage = python::folder(SUITE).join("stage");
    eprintln!("2 of 4: pages from docs/ and from the code");
    let (pages, nav) = staged(&root, environment, world.is_some())?;
    write_stage(&stage, &pages, &nav).map_err(|e| Failure::Failed(format!("{e:#}")))?;
    eprintln!("3 of 4: HTML and search ({} pages)", pages.texts.len());
    generate(environment, &stage)?;
    eprintln!("4 of 4: version {version} in {}", out.display());
    let folder = out.join(version);
    publish(&stage, &folder, world, &pages, &nav).map_err(|e| Failure::Failed(format!("{e:#}")))?;
    list_versions(out).map_err(|e| Failure::Failed(format!("{e:#}")))?;
    Ok(Site { folder, pages: pages.texts.len() })
}

/// All pages with their links as the site has them, and the navigation.
fn staged(root: &Path, environment: &Environment, has_world: bool) -> Result<(Pages, Nav), Failure> {
    let failed = |e: anyhow::Error| Failure::Failed(format!("{e:#}"));
    let mut pages = Pages::read(root).map_err(failed)?;
    let sources: Vec<(String, String)> =
        pages.texts.keys().map(|place| (place.clone(), source(place))).collect();
    reference::add(root, environment, crate::Cli::command(), &mut pages).map_err(failed)?;
    pages.add_indexes(&[
        ("computation", "# Equations\n\nThese pages give the equations behind the simulation, with sources, tests and limits."),
        ("decisions", "# Decisions\n\nThese pages tell why things are as they are, a decision each."),
        ("reference/configs", "# Configs\n\nThese pages list every figure of the simulation, the benchmark, the robots and the controllers, with value, unit, accepted range and source."),
    ]);
    let titles = pages.texts.iter().map(|(place, text)| (place.clone(), Some(title(text))));
    let mut places: BTreeMap<String, Option<String>> = titles.collect();
    places.extend(pages.files.keys().map(|place| (place.clone(), None)));
    places.insert(LIST.to_owned(), None);
    let links = Links { root, places, has_world };
    let mut problems = Vec::new();
    for (place, source) in sources {
        match links.rewrite(&source, &place, &pages.texts[&place]) {
            Ok(text) => drop(pages.texts.insert(place, text)),
            Err(errors) => problems.extend(errors),
        }
    }
    let config = std::fs::read_to_string(root.join(DOCS).join(CONFIG)).context(CONFIG).map_err(failed)?;
    let nav = Nav::read(&config).map_err(failed)?;
    problems.extend(nav.problems(&pages));
    match problems.as_slice() {
        [] => Ok((pages, nav)),
        _ => Err(Failure::Failed(problems.join("\n"))),
    }
}

/// The file of a page in the checkout.
fn source(place: &str) -> String {
    let outside = OUTSIDE.iter().find(|(_, there)| *there == place);
    outside.map_or_else(|| format!("{DOCS}/{place}"), |(file, _)| (*file).to_owned())
}

/// Writes what the generator reads.
fn write_stage(stage: &Path, pages: &Pages, nav: &Nav) -> anyhow::Result<()> {
    remove(stage)?;
    write_bytes(&made(stage.join(CONFIG))?, nav.config.as_bytes())?;
    for (place, text) in &pages.texts {
        write_bytes(&made(stage.join(DOCS).join(place))?, text.as_bytes())?;
    }
    for (place, file) in &pages.files {
        let there = made(stage.join(DOCS).join(place))?;
        std::fs::copy(file, &there).with_context(|| file.display().to_string())?;
    }
    Ok(())
}

/// Lets the generator make HTML, and shows what it refuses.
fn generate(environment: &Environment, stage: &Path) -> Result<(), Failure> {
    let mut command = environment.module(GENERATOR);
    command.args(["build", "--strict", "--clean"]).current_dir(stage).env("NO_COLOR", "1");
    let output = command.output().map_err(|e| Failure::Failed(format!("cannot run {GENERATOR}: {e}")))?;
    if output.status.success() {
        return Ok(());
    }
    let said = [output.stdout, output.stderr].concat();
    Err(Failure::Failed(format!("{GENERATOR} refuses the pages:\n{}", String::from_utf8_lossy(&said).trim())))
}

/// Puts a version into its folder: HTML, the pages as Markdown, the list for language models, the world in a browser.
fn publish(
    stage: &Path,
    folder: &Path,
    world: Option<&Path>,
    pages: &Pages,
    nav: &Nav,
) -> anyhow::Result<()> {
    remove(folder)?;
    copy(&stage.join("site"), folder)?;
    // Its links begin at the root of the host, where no version lies.
    remove(&folder.join("404.html"))?;
    for (place, text) in &pages.texts {
        write_bytes(&made(folder.join(place))?, text.as_bytes())?;
    }
    write_bytes(&folder.join(LIST), nav.for_language_models(pages).as_bytes())?;
    world.map_or(Ok(()), |world| copy(world, &folder.join(WORLD)))
}

/// Writes the list of the versions in a folder, newest first, and a page that leads to the first.
pub fn list_versions(out: &Path) -> anyhow::Result<()> {
    let mut versions = Vec::new();
    for entry in std::fs::read_dir(out).with_context(|| out.display().to_string())? {
        let entry = entry?;
        if entry.path().join(LIST).is_file() {
            versions.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    // Numbers by value, and words, such as `dev`, after all numbers.
    let key = |name: &String| {
        let parts: Vec<Option<u64>> = name.split('.').map(|part| part.parse().ok()).collect();
        (parts.iter().all(Option::is_some), parts, name.clone())
    };
    versions.sort_by_key(|name| std::cmp::Reverse(key(name)));
    let newest = versions.first().cloned().unwrap_or_default();
    let entry = |name: &String| serde_json::json!({ "version": name, "title": name, "aliases": [] });
    let list: Vec<serde_json::Value> = versions.iter().map(entry).collect();
    write_bytes(&out.join(VERSIONS), &serde_json::to_vec_pretty(&list)?)?;
    let page = format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>OrchardBench</title>\n<meta http-equiv=\"refresh\" content=\"0; url={newest}/\">\n\
         <p><a href=\"{newest}/\">OrchardBench, version {newest}</a></p>\n</html>\n"
    );
    write_bytes(&out.join("index.html"), page.as_bytes())?;
    Ok(())
}

/// A file's path, once its folder is there.
fn made(path: PathBuf) -> anyhow::Result<PathBuf> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    Ok(path)
}

/// Removes a file, or a folder with all that is in it, if it is there.
pub fn remove(path: &Path) -> anyhow::Result<()> {
    let removed = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
    match removed {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
            Err(e).with_context(|| path.display().to_string())
        }
        _ => Ok(()),
    }
}

/// Copies a folder with all that is in it.
pub fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(to).with_context(|| to.display().to_string())?;
    for entry in std::fs::read_dir(from).with_context(|| from.display().to_string())? {
        let entry = entry?;
        let (path, there) = (entry.path(), to.join(entry.file_name()));
        if entry.file_type()?.is_dir() {
            copy(&path, &there)?;
        } else {
            std::fs::copy(&path, &there).with_context(|| path.display().to_string())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_listed_newest_first() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["0.9.0", "dev", "0.10.0"] {
            std::fs::write(made(folder.path().join(name).join(LIST)).unwrap(), "").unwrap();
        }
        std::fs::create_dir(folder.path().join("other")).unwrap();
        list_versions(folder.path()).unwrap();
        let text = std::fs::read_to_string(folder.path().join(VERSIONS)).unwrap();
        let list: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
        let names: Vec<&str> = list.iter().filter_map(|entry| entry["version"].as_str()).collect();
        assert_eq!(names, ["0.10.0", "0.9.0", "dev"]);
        assert!(std::fs::read_to_string(folder.path().join("index.html")).unwrap().contains("url=0.10.0/"));
    }

    #[test]
    fn a_version_is_the_name_of_a_folder() {
        assert!(version("1.2.0").is_ok() && version("dev").is_ok());
        assert!(
            version("../x").is_err()
                && version("").is_err()
                && version(".a").is_err()
                && version("-a").is_err()
        );
    }
}
