//! `orchard gpu-info` in a program that was built without a graphics device.

use crate::failure::Failure;

/// Prints the graphics adapter, its limits and the kernel for it.
#[derive(clap::Args)]
pub struct Args {
    /// Options, which are ignored
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _rest: Vec<String>,
}

/// Reports the missing build feature.
pub fn run(_: &Args) -> Result<(), Failure> {
    Err(Failure::BadInput("gpu-info: this program was built without the feature `gpu`".to_owned()))
}
