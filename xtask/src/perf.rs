//! `cargo xtask perf`: how fast the parts are, as a file of rows.

mod episode;
mod physics;
mod timing;
mod trees;

use std::path::PathBuf;

use crate::failure::Failure;
use crate::rows::{Suite, run_suite};

/// Measures speed on this machine and writes the rows to a file.
#[derive(clap::Args)]
#[command(
    after_help = "Suites:\n  trees    trees grown a second, one core\n  physics  one tree in f64, 512 trees in lanes\n  episode  nominal episodes with picker and camera, one core\n\nExample:\n  \
                        cargo xtask perf trees --json trees.json"
)]
pub struct Args {
    /// What to measure.
    suite: String,
    /// Where to write the rows.
    #[arg(long, value_name = "FILE")]
    json: PathBuf,
}

const SUITES: &[Suite] = &[
    Suite { name: "trees", about: "trees grown a second, one core", measure: trees::measure },
    Suite { name: "physics", about: "one tree in f64, 512 trees in lanes", measure: physics::measure },
    Suite {
        name: "episode",
        about: "nominal episodes with picker and camera, one core",
        measure: episode::measure,
    },
];

pub fn run(args: &Args) -> Result<(), Failure> {
    run_suite("perf", SUITES, &args.suite, &args.json)
}
