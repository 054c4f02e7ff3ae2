//! `orchard demos` in a program that was built without demonstrations.

use crate::failure::Failure;
use crate::program::Program;

/// Lets a controller demonstrate a task, and writes every step as a policy would have seen it.
#[derive(clap::Args)]
pub struct Args {
    /// Options, which are ignored
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _rest: Vec<String>,
}

/// Reports the missing build feature.
pub fn run(_: &Args, _: &Program) -> Result<(), Failure> {
    Err(Failure::BadInput("demos: this program was built without the feature `demos`".to_owned()))
}
