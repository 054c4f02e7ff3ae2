//! Tools for developers of this project: `cargo xtask COMMAND`, one file per command.

#[macro_use]
extern crate orchard_program;

mod browser;
mod check_combinations;
mod check_learning;
mod check_network;
mod check_python;
mod check_report;
mod check_site;
mod check_statistics;
mod check_web;
mod fuzz;
mod judge;
mod perf;
mod python;
mod read_back;
mod reuse;
mod site;
mod test;
mod tidy;
mod web;
mod workspace;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use orchard_program::Failure;

/// Tests OrchardBench, compares it with third-party tools, and measures its speed.
#[derive(Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    arg_required_else_help = true,
    after_help = "Examples:\n  cargo xtask test            everything that a change must pass\n  \
                  cargo xtask test --quick    only the crates that changed\n\n\
                  Every other command of `cargo xtask` is forwarded to the program `orchard`: `cargo xtask bench-v1`, .."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    CheckCombinations(check_combinations::Args),
    CheckNetwork(check_network::Args),
    CheckPython(check_python::Args),
    CheckReport(check_report::Args),
    CheckSite(check_site::Args),
    CheckStatistics(check_statistics::Args),
    CheckWeb(check_web::Args),
    Fuzz(fuzz::Args),
    Judge(judge::Args),
    Perf(perf::Args),
    ReadBack(read_back::Args),
    CheckReuse(reuse::Args),
    Site(site::Args),
    Test(test::Args),
    Tidy(tidy::Args),
    Web(web::Args),
}

fn main() -> ExitCode {
    if let Some(code) = fuzz::as_compiler() {
        return code;
    }
    Failure::finish(
        Cli::try_parse().map_err(|e| Failure::of_command_line(&e)).and_then(|cli| execute(&cli.command)),
    )
}

fn execute(command: &Command) -> Result<(), Failure> {
    match command {
        Command::CheckCombinations(args) => check_combinations::run(args),
        Command::CheckNetwork(args) => check_network::run(args),
        Command::CheckPython(args) => check_python::run(args),
        Command::CheckReport(args) => check_report::run(args),
        Command::CheckSite(args) => check_site::run(args),
        Command::CheckStatistics(args) => check_statistics::run(args),
        Command::CheckWeb(args) => check_web::run(args),
        Command::Fuzz(args) => fuzz::run(args),
        Command::Judge(args) => judge::run(args),
        Command::Perf(args) => perf::run(args),
        Command::ReadBack(args) => read_back::run(args),
        Command::CheckReuse(args) => reuse::run(args),
        Command::Site(args) => site::run(args),
        Command::Test(args) => test::run(args),
        Command::Tidy(args) => tidy::run(args),
        Command::Web(args) => web::run(args),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
