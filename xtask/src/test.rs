//! `cargo xtask test`: everything that a change must pass.

use std::process::Command;

use crate::failure::Failure;
use crate::{tidy, workspace};

/// Checks format, lints and order, then runs all tests.
#[derive(clap::Args)]
#[command(
    after_help = "Steps: cargo fmt --check, cargo clippy -D warnings, cargo xtask tidy, cargo test --workspace.\n\
                        All steps run; the last lines say which passed."
)]
pub struct Args {}

pub fn run(_: &Args) -> Result<(), Failure> {
    type Step = (&'static str, fn() -> Result<(), Failure>);
    let steps: [Step; 4] = [
        ("format", || cargo(&["fmt", "--all", "--check"])),
        ("clippy", || cargo(&["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"])),
        ("tidy", || tidy::run(&tidy::Args {})),
        ("tests", || cargo(&["test", "--workspace", "--quiet"])),
    ];
    let mut results = Vec::new();
    for (name, step) in steps {
        eprintln!("== {name}");
        results.push((name, step()));
    }
    eprintln!("==");
    for (name, result) in &results {
        match result {
            Ok(()) => eprintln!("pass  {name}"),
            Err(failure) => eprintln!("FAIL  {name}: {failure}"),
        }
    }
    let failed = results.iter().filter(|(_, result)| result.is_err()).count();
    if failed == 0 {
        eprintln!("all {} steps passed", results.len());
        Ok(())
    } else {
        Err(Failure::Failed(format!("{failed} of {} steps failed", results.len())))
    }
}

fn cargo(args: &[&str]) -> Result<(), Failure> {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(program).args(args).current_dir(workspace::root()).status();
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Failure::Failed(format!("cargo {} ended with {status}", args[0]))),
        Err(e) => Err(Failure::Failed(format!("cannot run cargo {}: {e}", args[0]))),
    }
}
