//! `orchard robot`: robot descriptions.

mod check;
mod draft;
mod picture;
mod table;

use crate::failure::Failure;

/// Checks robot descriptions.
#[derive(clap::Args)]
#[command(arg_required_else_help = true)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    Check(check::Args),
}

pub fn run(args: &Args) -> Result<(), Failure> {
    match &args.command {
        Command::Check(args) => check::run(args),
    }
}
