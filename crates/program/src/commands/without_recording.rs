//! `orchard replay` in a program that was built without recordings.

use crate::failure::Failure;
use crate::program::Program;

/// Simulates a recorded episode again and checks that all bytes agree.
#[derive(clap::Args)]
pub struct Args {
    /// Options, which are ignored
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _rest: Vec<String>,
}

/// Reports the missing build feature.
pub fn run(_: &Args, _: &Program) -> Result<(), Failure> {
    Err(Failure::BadInput("replay: this program was built without the feature `recording`".to_owned()))
}
