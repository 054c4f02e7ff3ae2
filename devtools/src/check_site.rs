//! `cargo xtask check-site`: runs the tutorials, and opens the documentation site in a browser.

mod tutorials;

use std::path::PathBuf;
use std::time::Instant;

use orchard_program::{Failure, Verdict};

use crate::{browser, check_python, python, site, workspace};
use tutorials::Programs;

/// Runs every command, program and file of the tutorials as the pages have them, builds the site, and opens it in headless Chromium at 1280 and
/// 390 px.
#[derive(clap::Args)]
#[command(
    after_help = "Tutorials: docs/tutorials/*.md and docs/robots.md, each in a fresh folder with a copy of examples/, in the order of their blocks:\n  \
                  a block with title=\"FILE\" is written to FILE, or must be the file of that name in the checkout\n  \
                  a block of sh or python is run; a block of text after it must be in what it prints\n  \
                  a block below a line that begins with \"Our checks do not run this block\" is not run\n\
                  `orchard` is the build of the tests; `cargo run --release --` runs their build of examples/own-controller.\n\n\
                  Site: every link, anchor and picture is there, every picture has a text, no page is wider than the window, none loads anything from elsewhere or writes to the\n\
                  console; search finds, the selector lists the versions. Screenshots are written to target/site/*.png.\n\n\
                  Takes 54 s of one processor core once everything is built, 40 s of them for the tutorials. Needs Chromium (Debian: chromium), python3 with venv, and the network on the\n\
                  first run. What is missing is named and the check is skipped; with CI=true in the environment it fails."
)]
pub struct Args {
    /// Only the tutorials whose file names contain this text, and no site
    #[arg(long, value_name = "TEXT")]
    tutorial: Option<String>,
}

/// Environment with numpy, Gymnasium and what tutorials in Python need.
const PYTHON: &str = "python";
/// Packages of Cargo with the programs that tutorials call.
const PROGRAMS: [&str; 2] = ["orchardbench", "orchard-tests"];
/// Versions of the site that are built, so that the selector has something to select.
const VERSIONS: [&str; 2] = ["0.0.1", env!("CARGO_PKG_VERSION")];

pub fn run(args: &Args) -> Result<(), Failure> {
    if let Verdict::Skipped(reason) = check(args)? {
        eprintln!("SKIPPED: tutorials and site are not checked: {reason}");
    }
    Ok(())
}

/// Runs the tutorials, then builds and opens the site; `Skipped` gives the reason why it cannot.
fn check(args: &Args) -> Result<Verdict, Failure> {
    let environment = match python::environment(PYTHON)? {
        Ok(environment) => environment,
        Err(skipped) => return Ok(skipped),
    };
    let package = check_python::build(&PROGRAMS)?;
    let start = Instant::now();
    let programs = Programs::install(&environment, &package)?;
    let run = tutorials::run(&workspace::root(), &programs, args.tutorial.as_deref())?;
    say!("{run} blocks of the tutorials in {} s", start.elapsed().as_secs());
    if args.tutorial.is_some() {
        return Ok(Verdict::Agreed);
    }
    let chromium = match browser::find()? {
        Ok(chromium) => chromium,
        Err(skipped) => return Ok(skipped),
    };
    let environment = match python::environment(site::SUITE)? {
        Ok(environment) => environment,
        Err(skipped) => return Ok(skipped),
    };
    let start = Instant::now();
    let folder = python::folder(site::SUITE);
    let out = folder.join("out");
    site::remove(&out).map_err(|e| Failure::Failed(format!("{e:#}")))?;
    let world = Some(python::folder("web").join("page")).filter(|world| world.join("index.html").is_file());
    let built = site::build(&environment, world.as_deref(), &out, VERSIONS[1])?;
    // An older version is the same site under another name.
    site::copy(&built.folder, &out.join(VERSIONS[0])).map_err(|e| Failure::Failed(format!("{e:#}")))?;
    site::list_versions(&out).map_err(|e| Failure::Failed(format!("{e:#}")))?;
    environment.compare("check.py", &[chromium, out, PathBuf::from(VERSIONS[1]), folder.clone()])?;
    say!("{} pages in {} s; screenshots: {}", built.pages, start.elapsed().as_secs(), folder.display());
    Ok(Verdict::Agreed)
}
