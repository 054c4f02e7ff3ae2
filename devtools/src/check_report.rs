//! `cargo xtask check-report`: opens a report in a browser.

use std::path::{Path, PathBuf};

use crate::{browser, python};
use orchard_program::Failure;
use orchard_program::commands::report;
use orchard_program::{Program, Verdict};
use std::ffi::OsString;

/// Runs a small benchmark, writes its report, and opens it in headless Chromium at 1280 and 390 px, by day and by night.
#[derive(clap::Args)]
#[command(
    after_help = "Checks in the browser: nothing is wider than the window, nothing is loaded from elsewhere, there is no error, every\n\
                  image loads, text in figures is large enough and does not overlap. Screenshots for inspection are written to\n\
                  target/report/*.png.\n\n\
                  Needs Chromium (Debian: chromium), python3 with venv, and the network on the first run: the driver goes into\n\
                  target/report/venv, no browser is downloaded. If they are missing, the check is skipped with a message; with CI=true\n\
                  in the environment it fails."
)]
pub struct Args {
    /// The report of this result folder instead of a small run's
    #[arg(value_name = "DIR")]
    dir: Option<PathBuf>,
}

/// Folder of the script and of the screenshots.
const SUITE: &str = "report";
/// Every task and every sweep, each at its smallest size.
const RUN: [&str; 11] = [
    "bench-v1",
    "--tasks",
    "harvest,detect,reach-and-grasp,gentle",
    "--conditions",
    "nominal,foliage,fruit,terrain",
    "--seeds",
    "20250704,20250705",
    "--trees",
    "1",
    "--horizon",
    "15",
];

pub fn run(args: &Args) -> Result<(), Failure> {
    match check(args.dir.as_deref())? {
        Verdict::Agreed => say!("screenshots: {}", python::folder(SUITE).display()),
        Verdict::Skipped(reason) => eprintln!("SKIPPED: the report is not opened in a browser: {reason}"),
    }
    Ok(())
}

/// Opens the report of a folder, or of a small run; `Skipped` gives the reason why it cannot.
fn check(dir: Option<&Path>) -> Result<Verdict, Failure> {
    let browser = match browser::find()? {
        Ok(browser) => browser,
        Err(skipped) => return Ok(skipped),
    };
    let environment = match python::environment(SUITE)? {
        Ok(environment) => environment,
        Err(skipped) => return Ok(skipped),
    };
    let dir = match dir {
        Some(dir) => dir.to_owned(),
        None => small_run()?,
    };
    let written = report::write(&dir, false, &Program::new())?;
    environment.compare("check.py", &[browser, python::folder(SUITE), written.page])?;
    Ok(Verdict::Agreed)
}

/// A small run of the current code; an existing run is continued.
fn small_run() -> Result<PathBuf, Failure> {
    let dir = python::folder(SUITE).join("run");
    let line = [&["orchard"][..], &RUN[..]].concat().into_iter().map(OsString::from);
    Program::new().call(line.chain(["--out".into(), dir.clone().into_os_string()]))?;
    Ok(dir)
}
