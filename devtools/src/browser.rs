//! Chromium of the system, for checks of pages.

use std::path::PathBuf;

use orchard_program::{Failure, Verdict};

/// Program names of Chromium.
const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// Finds Chromium, or gives the reason why a check is skipped. In continuous integration that is a failure.
pub fn find() -> Result<Result<PathBuf, Verdict>, Failure> {
    match BROWSERS.iter().find_map(|name| in_path(name)) {
        Some(browser) => Ok(Ok(browser)),
        None => lacking(format!("none of {} found", BROWSERS.join(", "))).map(Err),
    }
}

/// The verdict on a check that lacks something: skipped, but a failure in continuous integration.
pub fn lacking(problem: String) -> Result<Verdict, Failure> {
    if std::env::var_os("CI").is_some_and(|ci| ci == "true") {
        return Err(Failure::Failed(format!("needed in continuous integration: {problem}")));
    }
    Ok(Verdict::Skipped(problem))
}

/// Finds a program in the search path.
fn in_path(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(name)).find(|program| program.is_file())
}
