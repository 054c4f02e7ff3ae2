//! The project's runner: `cargo xtask COMMAND`, one file a command.

/// Writes a line for whoever reads; one who has read enough and closed the pipe is no failure.
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write;
        let _ = writeln!(std::io::stdout(), $($text)*);
    }};
}

mod bare_tree;
mod bench_v1;
mod check_report;
mod check_statistics;
mod columns;
mod dataset;
mod detect;
mod explain;
mod export_tree;
mod failure;
mod fuzz;
mod gallery;
mod gpu_info;
mod headline;
mod interrupt;
mod judge;
mod leaderboard;
mod merge;
mod perf;
mod picture_file;
mod python;
mod read_back;
mod render;
mod replay;
mod report;
mod robot;
mod rows;
mod sensing_args;
mod test;
mod tidy;
mod tree_args;
mod validate;
mod verify;
mod workspace;

use std::process::ExitCode;

use clap::{Parser, Subcommand, error::ErrorKind};

use failure::Failure;

/// Runs OrchardBench and keeps it in order.
#[derive(Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    arg_required_else_help = true,
    after_help = "Examples:\n  cargo xtask bench-v1                    the quick benchmark, results in results/\n  \
                  cargo xtask bench-v1 --profile full     the whole matrix, 3 seeds x 6 trees x 75 s\n  \
                  cargo xtask test                        everything that a change must pass"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    BenchV1(bench_v1::Args),
    CheckReport(check_report::Args),
    CheckStatistics(check_statistics::Args),
    Dataset(dataset::Args),
    Detect(detect::Args),
    Explain(explain::Args),
    Render(render::Args),
    Replay(replay::Args),
    Gallery(gallery::Args),
    GpuInfo(gpu_info::Args),
    ExportTree(export_tree::Args),
    Judge(judge::Args),
    Leaderboard(leaderboard::Args),
    Merge(merge::Args),
    ReadBack(read_back::Args),
    Report(report::Args),
    Perf(perf::Args),
    Robot(robot::Args),
    Validate(validate::Args),
    Verify(verify::Args),
    Test(test::Args),
    Fuzz(fuzz::Args),
    Tidy(tidy::Args),
}

fn main() -> ExitCode {
    let result = match Cli::try_parse() {
        Ok(cli) => match cli.command {
            Command::BenchV1(args) => bench_v1::run(&args),
            Command::CheckReport(args) => check_report::run(&args),
            Command::CheckStatistics(args) => check_statistics::run(&args),
            Command::Dataset(args) => dataset::run(&args),
            Command::Detect(args) => detect::run(&args),
            Command::Explain(args) => explain::run(&args),
            Command::Render(args) => render::run(&args),
            Command::Replay(args) => replay::run(&args),
            Command::Gallery(args) => gallery::run(&args),
            Command::GpuInfo(args) => gpu_info::run(&args),
            Command::ExportTree(args) => export_tree::run(&args),
            Command::Judge(args) => judge::run(&args),
            Command::Leaderboard(args) => leaderboard::run(&args),
            Command::Merge(args) => merge::run(&args),
            Command::ReadBack(args) => read_back::run(&args),
            Command::Report(args) => report::run(&args),
            Command::Perf(args) => perf::run(&args),
            Command::Robot(args) => robot::run(&args),
            Command::Validate(args) => validate::run(&args),
            Command::Verify(args) => verify::run(&args),
            Command::Test(args) => test::run(&args),
            Command::Fuzz(args) => fuzz::run(&args),
            Command::Tidy(args) => tidy::run(&args),
        },
        Err(e) if e.use_stderr() && e.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            Err(Failure::BadInput(one_line(&e.to_string())))
        }
        Err(help) => help.exit(),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            failure.exit_code()
        }
    }
}

/// The first paragraph of a parser's message as one line.
fn one_line(message: &str) -> String {
    let paragraph = message.split("\n\n").next().unwrap_or_default();
    let words: Vec<&str> = paragraph.split_whitespace().collect();
    format!("{} (--help tells more)", words.join(" ").trim_start_matches("error: "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn bad_input_is_told_in_one_line() {
        let message = |args: &[&str]| match Cli::try_parse_from(args) {
            Ok(_) => panic!("{args:?} was accepted"),
            Err(e) => one_line(&e.to_string()),
        };
        let line = message(&["x", "bench-v1", "--trees", "many"]);
        assert!(line.starts_with("invalid value 'many' for '--trees <N>'"), "{line}");
        let line = message(&["x", "perf"]);
        assert!(line.contains("<SUITE>") && !line.contains('\n'), "{line}");
    }
}
