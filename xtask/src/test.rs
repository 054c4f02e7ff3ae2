//! `cargo xtask test`: everything that a change must pass.

use std::process::Command;

use crate::failure::Failure;
use crate::judge;
use crate::python::Verdict;
use crate::{check_report, check_statistics, fuzz, read_back, tidy, validate, workspace};

/// Checks format, lints and order, then runs all tests.
#[derive(clap::Args)]
#[command(
    after_help = "Steps: cargo fmt --check, cargo clippy -D warnings, cargo xtask tidy, cargo test --workspace, cargo xtask validate gpu (skipped without a graphics adapter), cargo xtask judge,\n  cargo xtask check-statistics, cargo xtask read-back, cargo xtask check-report,\n  cargo xtask fuzz.\n\
                        All steps run; the last lines say which passed."
)]
pub struct Args {}

/// Time for each fuzz target [s].
const FUZZ_SECONDS: u32 = 20;

/// How a step ended that did not fail.
enum Outcome {
    Passed,
    /// It could not run here; why.
    Skipped(String),
}

pub fn run(_: &Args) -> Result<(), Failure> {
    type Step = (&'static str, fn() -> Result<Outcome, Failure>);
    let steps: [Step; 10] = [
        ("format", || cargo(&["fmt", "--all", "--check"])),
        ("clippy", || cargo(&["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"])),
        ("tidy", || tidy::run(&tidy::Args {}).map(|()| Outcome::Passed)),
        ("tests", || cargo(&["test", "--workspace", "--quiet"])),
        ("gpu", || validate::check_gpu().map(outcome)),
        ("judge", || judge::judge().map(outcome)),
        ("statistics", || check_statistics::check().map(outcome)),
        ("read-back", || read_back::read_back().map(outcome)),
        ("report", || check_report::check().map(outcome)),
        ("fuzz", || fuzz::fuzz(FUZZ_SECONDS).map(outcome)),
    ];
    let mut results = Vec::new();
    for (name, step) in steps {
        eprintln!("== {name}");
        results.push((name, step()));
    }
    eprintln!("==");
    for (name, result) in &results {
        match result {
            Ok(Outcome::Passed) => eprintln!("pass  {name}"),
            Ok(Outcome::Skipped(reason)) => eprintln!("SKIPPED  {name}: {reason}"),
            Err(failure) => eprintln!("FAIL  {name}: {failure}"),
        }
    }
    let failed = results.iter().filter(|(_, result)| result.is_err()).count();
    if failed == 0 {
        let skipped = results.iter().filter(|(_, r)| matches!(r, Ok(Outcome::Skipped(_)))).count();
        eprintln!("{} of {} steps passed, {skipped} skipped", results.len() - skipped, results.len());
        Ok(())
    } else {
        Err(Failure::Failed(format!("{failed} of {} steps failed", results.len())))
    }
}

fn outcome(verdict: Verdict) -> Outcome {
    match verdict {
        Verdict::Agreed => Outcome::Passed,
        Verdict::Skipped(reason) => Outcome::Skipped(reason),
    }
}

fn cargo(args: &[&str]) -> Result<Outcome, Failure> {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(program).args(args).current_dir(workspace::root()).status();
    match status {
        Ok(status) if status.success() => Ok(Outcome::Passed),
        Ok(status) => Err(Failure::Failed(format!("cargo {} ended with {status}", args[0]))),
        Err(e) => Err(Failure::Failed(format!("cannot run cargo {}: {e}", args[0]))),
    }
}
