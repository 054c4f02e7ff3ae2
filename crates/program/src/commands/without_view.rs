//! `orchard view` in a program that was built without a window.

use crate::failure::Failure;
use crate::program::Program;

/// Shows a scenario live in a window, or draws pictures of it.
#[derive(clap::Args)]
pub struct Args {
    /// Options, which are ignored
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _rest: Vec<String>,
}

/// Reports the missing build feature.
pub fn run(_: &Args, _: &Program) -> Result<(), Failure> {
    let line = "view: this program was built without the feature `view`; build it with `cargo install --path crates/orchard --features view`";
    Err(Failure::BadInput(line.to_owned()))
}
