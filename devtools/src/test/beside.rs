//! Checks that compile little. They run beside the builds, one after another, each as a process of its own whose output is shown when it ends; some
//! compile programs.

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Instant;

use orchard_program::{Failure, Verdict};

use super::Outcome;
use crate::workspace;

/// Name of each check, and its command.
const CHECKS: [(&str, &str); 10] = [
    ("tidy", "tidy"),
    ("combinations", "check-combinations"),
    ("judge", "judge"),
    ("statistics", "check-statistics"),
    ("read-back", "read-back"),
    ("report", "check-report"),
    ("web", "check-web"),
    ("network", "check-network"),
    ("python", "check-python"),
    ("site", "check-site"),
];

/// Begins the line by which a check says that it was skipped, and why.
const SKIPPED: &str = "SKIPPED: ";

/// Runs all checks.
pub fn run() -> Vec<Outcome> {
    CHECKS
        .iter()
        .map(|&(name, command)| {
            let start = Instant::now();
            let (shown, result) = check(command);
            eprint!("== {name}, beside the builds\n{shown}");
            Outcome { name, result, time: start.elapsed() }
        })
        .collect()
}

/// Runs one command of these tools; returns what it printed, and how it ended.
fn check(command: &str) -> (String, Result<Verdict, Failure>) {
    let run = |this: PathBuf| Ok(Command::new(this).arg(command).stdin(Stdio::null()).output()?);
    let output = workspace::tools().and_then(run);
    match output {
        Err(e) => (String::new(), Err(Failure::Failed(format!("cannot run {command}: {e}")))),
        Ok(output) => {
            let printed = [output.stdout, output.stderr].concat();
            let printed = String::from_utf8_lossy(&printed).into_owned();
            let result = match printed.lines().find_map(|line| line.strip_prefix(SKIPPED)) {
                _ if !output.status.success() => {
                    Err(Failure::Failed(format!("{command} ended with {}", output.status)))
                }
                Some(reason) => Ok(Verdict::Skipped(reason.to_owned())),
                None => Ok(Verdict::Agreed),
            };
            (printed, result)
        }
    }
}
