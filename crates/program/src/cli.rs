//! The command line: commands, dispatch, exit codes.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::commands::{
    bench_field, bench_v1, dataset, demos, detect, explain, export_tree, gallery, gpu_info, leaderboard,
    merge, names, perf, render, replay, report, robot, scenario, validate, verify, view,
};
use crate::failure::{EXIT_CODES, Failure};
use crate::program::Program;

/// Grows apple trees, lets robots harvest them, and measures the harvest.
#[derive(Parser)]
#[command(
    name = "orchard",
    version,
    arg_required_else_help = true,
    after_help = format!("Examples:\n  orchard bench-v1                        the quick benchmark, results in results/\n  \
                  orchard bench-v1 --profile full         the whole matrix, 3 seeds x 6 trees x 75 s\n  \
                  orchard bench-v1 --preset tall-spindle --camera d435i --controller expert\n  \
                  orchard scenario show --preset v-trellis    every figure of a scenario, with its origin\n\n{EXIT_CODES}")
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    BenchV1(bench_v1::Args),
    BenchField(bench_field::Args),
    Report(report::Args),
    Explain(explain::Args),
    Replay(replay::Args),
    Merge(merge::Args),
    Leaderboard(leaderboard::Args),
    Verify(verify::Args),
    Render(render::Args),
    View(view::Args),
    Gallery(gallery::Args),
    ExportTree(export_tree::Args),
    Dataset(dataset::Args),
    Demos(demos::Args),
    Detect(detect::Args),
    Scenario(scenario::Args),
    /// Prints the names of the presets, one per line
    Presets,
    /// Prints the names of the robots, one per line
    Robots,
    /// Prints the names of the cameras, one per line
    Cameras,
    /// Prints the names of the detectors, one per line
    Detectors,
    /// Prints the names of the controllers, one per line
    Controllers,
    Robot(robot::Args),
    Validate(validate::Args),
    Perf(perf::Args),
    GpuInfo(gpu_info::Args),
}

/// All commands and options of `orchard`, for documentation and for checks of command lines.
pub fn command_line() -> clap::Command {
    Cli::command()
}

impl Program {
    /// Runs the command that the process was started with.
    pub fn main(&self) -> ExitCode {
        self.run(std::env::args_os())
    }

    /// Runs a command line (first word: the program's name). Errors are printed to stderr; the exit code gives their kind.
    pub fn run(&self, line: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> ExitCode {
        Failure::finish(self.call(line))
    }

    /// Runs a command line (first word: the program's name). `--help` and `--version` end the process.
    ///
    /// # Errors
    /// The command line does not parse, or the command fails.
    pub fn call(&self, line: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<(), Failure> {
        let cli = self.parse(line).map_err(|e| Failure::of_command_line(&e))?;
        self.execute(&cli.command)
    }

    fn parse(&self, line: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<Cli, clap::Error> {
        let mut command = Cli::command();
        let matches = command.try_get_matches_from_mut(line)?;
        Cli::from_arg_matches(&matches).map_err(|e| e.format(&mut command))
    }

    fn execute(&self, command: &Command) -> Result<(), Failure> {
        match command {
            Command::BenchV1(args) => bench_v1::run(args, self),
            Command::BenchField(args) => bench_field::run(args, self),
            Command::Report(args) => report::run(args, self),
            Command::Explain(args) => explain::run(args, self),
            Command::Replay(args) => replay::run(args, self),
            Command::Merge(args) => merge::run(args, self),
            Command::Leaderboard(args) => leaderboard::run(args, self),
            Command::Verify(args) => verify::run(args, self),
            Command::Render(args) => render::run(args, self),
            Command::View(args) => view::run(args, self),
            Command::Gallery(args) => gallery::run(args),
            Command::ExportTree(args) => export_tree::run(args, self),
            Command::Dataset(args) => dataset::run(args, self),
            Command::Demos(args) => demos::run(args, self),
            Command::Detect(args) => detect::run(args),
            Command::Scenario(args) => scenario::run(args, self),
            Command::Presets => names::print(&orchard_scenario::presets()),
            Command::Robots => names::print(&orchard_scenario::robots()),
            Command::Cameras => names::print(&orchard_scenario::cameras()),
            Command::Detectors => names::print(&orchard_scenario::detectors()),
            Command::Controllers => {
                let names: Vec<&str> = self.controllers().iter().map(|kind| kind.name()).collect();
                names::print(&names)
            }
            Command::Robot(args) => robot::run(args),
            Command::Validate(args) => validate::run(args),
            Command::Perf(args) => perf::run(args),
            Command::GpuInfo(args) => gpu_info::run(args),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn bad_input_is_told_in_one_line() {
        let message = |args: &[&str]| match Cli::try_parse_from(args) {
            Ok(_) => panic!("{args:?} was accepted"),
            Err(e) => Failure::of_command_line(&e).to_string(),
        };
        let line = message(&["x", "bench-v1", "--trees", "many"]);
        assert!(line.starts_with("invalid value 'many' for '--trees <N>'"), "{line}");
        let line = message(&["x", "validate"]);
        assert!(line.contains("<SUITE>") && !line.contains('\n'), "{line}");
    }
}
