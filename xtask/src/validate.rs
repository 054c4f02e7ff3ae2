//! `cargo xtask validate`: the simulator against closed forms and measurements, as a file of rows.

use std::path::PathBuf;

use crate::failure::Failure;
use crate::rows::{Effort, Suite, run_suite};

/// Holds the simulator against closed forms and published measurements and writes the rows to a file.
#[derive(clap::Args)]
pub struct Args {
    /// What to validate.
    suite: String,
    /// Where to write the rows.
    #[arg(long, value_name = "FILE")]
    json: PathBuf,
}

/// The suites come with the reports that they fill.
const SUITES: &[Suite] = &[];

pub fn run(args: &Args) -> Result<(), Failure> {
    run_suite("validation", SUITES, &args.suite, &args.json, Effort::Full)
}
