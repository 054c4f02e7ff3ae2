//! `orchard view` in a program that was built without a window.

use super::Args;
use crate::failure::Failure;
use crate::program::Program;

/// Reports the missing build feature.
pub fn run(_: &Args, _: &Program) -> Result<(), Failure> {
    let line = "view: this program was built without the feature `view`; build it with `cargo install --path crates/orchard --features view`";
    Err(Failure::BadInput(line.to_owned()))
}
