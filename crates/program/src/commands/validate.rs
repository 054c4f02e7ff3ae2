//! `orchard validate`: compares the simulator with measurements, with f64 results and with itself, and writes a file of rows.

#[cfg(feature = "gpu")]
mod gpu;
pub mod ik;
mod trees;

use std::path::PathBuf;

use crate::failure::Failure;
#[cfg(feature = "gpu")]
use crate::failure::Verdict;
use crate::rows::{Effort, Suite, run_suite};

/// Compares the simulator with published measurements, the graphics device with f64, or inverse with forward kinematics; writes the rows to a
/// file.
#[derive(clap::Args)]
#[command(
    after_help = "Suites:\n  trees  200 grown trees of each calibrated preset against measured apple trees\n  ik     10,000 reachable tool poses of each robot, solved by both inverse kinematics\n  gpu    trees on the graphics device against the same trees in f64: states, ruptures, detachments\n\n\
                  A row of trees has the figure of the grown trees, the measured figure as its target, and the target interval.\n\
                  Histograms are written to the folder FILE-pictures beside FILE. A missed target gives exit code 1 unless\n\
                  its row has a reason why it cannot be met.\n\nExample:\n  orchard validate trees --json trees.json"
)]
pub struct Args {
    /// Suite to run
    suite: String,
    /// JSON file for the rows
    #[arg(long, value_name = "FILE")]
    json: PathBuf,
}

const SUITES: &[Suite] = &[
    Suite {
        name: "trees",
        about: "200 grown trees of each calibrated preset against measured ones",
        measure: trees::measure,
    },
    Suite {
        name: "ik",
        about: "10,000 reachable tool poses of each robot, solved by both inverse kinematics",
        measure: ik::measure,
    },
    #[cfg(feature = "gpu")]
    Suite {
        name: "gpu",
        about: "trees on the graphics device against the same trees in f64",
        measure: gpu::measure,
    },
];

/// Compares the graphics device, if there is one, with f64.
#[cfg(feature = "gpu")]
pub fn check_gpu() -> Result<Verdict, Failure> {
    gpu::check()
}

pub fn run(args: &Args) -> Result<(), Failure> {
    run_suite("validation", SUITES, &args.suite, &args.json, Effort::Full)
}
