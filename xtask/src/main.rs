//! Forwards `cargo xtask COMMAND` to the program `orchard` or to the developers' tools.
//!
//! It has no dependencies, so that it is built in a moment: whoever runs the benchmark builds the program and nothing else.

use std::path::Path;
use std::process::{Command, ExitCode};

/// Commands of the developers' tools (`devtools`); every other command is one of the program's.
const DEVELOPER: [&str; 10] = [
    "check-combinations",
    "check-report",
    "check-reuse",
    "check-statistics",
    "fuzz",
    "judge",
    "perf",
    "read-back",
    "test",
    "tidy",
];

/// Commands of the developers' tools whose figures or run times need the optimised build.
const OPTIMISED: [&str; 1] = ["perf"];

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let command = args.first().map_or("", String::as_str);
    let is_help = matches!(command, "" | "help" | "--help" | "-h");
    if is_help {
        eprintln!(
            "cargo xtask COMMAND forwards to the program `orchard` (below), with the same options.\n\
             For developers of this project: cargo xtask {}\n",
            DEVELOPER.join(" | ")
        );
    }
    let (package, profile) = match DEVELOPER.contains(&command) {
        true if OPTIMISED.contains(&command) => ("devtools", "release"),
        true => ("devtools", "dev"),
        false => ("orchardbench", "release"),
    };
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.toml");
    let status = Command::new(cargo)
        .args(["run", "--quiet", "--package", package, "--profile", profile, "--manifest-path"])
        .arg(manifest)
        .arg("--")
        .args(&args)
        .status();
    match status {
        Ok(status) => ExitCode::from(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1)),
        Err(e) => {
            eprintln!("error: cannot run cargo: {e}");
            ExitCode::FAILURE
        }
    }
}
