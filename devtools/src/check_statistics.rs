//! `cargo xtask check-statistics`: the statistics of results against scipy.

mod cases;

use orchard_bench::store::write_json;

use crate::python;
use orchard_program::Failure;
use orchard_program::Verdict;

/// Compares intervals, paired tests, effect sizes, corrections and variance components with scipy's, to 1e-6.
#[derive(clap::Args)]
#[command(
    after_help = "Needs python3 with venv, and the network on the first run: scipy is installed into target/statistics/venv.\n\
                  If they are missing, the comparison is skipped with a message; with CI=true in the environment it fails.\n\
                  The samples and our figures of the last run are in target/statistics/cases.json."
)]
pub struct Args {}

/// Folder of the script and of the last run's output.
const SUITE: &str = "statistics";

pub fn run(_: &Args) -> Result<(), Failure> {
    if let Verdict::Skipped(reason) = check()? {
        eprintln!("SKIPPED: no comparison with scipy: {reason}");
    }
    Ok(())
}

/// Compares; `Skipped` gives the reason why it cannot. In continuous integration that is a failure.
fn check() -> Result<Verdict, Failure> {
    let environment = match python::environment(SUITE)? {
        Ok(environment) => environment,
        Err(skipped) => return Ok(skipped),
    };
    let file = python::folder(SUITE).join("cases.json");
    write_json(&file, &cases::Cases::all().map_err(anyhow::Error::msg)?).map_err(anyhow::Error::from)?;
    environment.compare("compare.py", &[file])?;
    Ok(Verdict::Agreed)
}
