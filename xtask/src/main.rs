//! Forwards `cargo xtask COMMAND` to the program `orchard` or to the developers' tools.
//!
//! It has no dependencies, so that it is built in a moment: whoever runs the benchmark builds the program and nothing else.

use std::path::Path;
use std::process::{Command, ExitCode};

/// Commands of the developers' tools (`devtools`); every other command is one of the program's.
const DEVELOPER: [&str; 16] = [
    "check-combinations",
    "check-network",
    "check-python",
    "check-report",
    "check-reuse",
    "check-site",
    "check-statistics",
    "check-web",
    "fuzz",
    "judge",
    "perf",
    "read-back",
    "site",
    "test",
    "tidy",
    "web",
];

/// Commands of the developers' tools whose figures or run times need the optimised build.
const OPTIMISED: [&str; 1] = ["perf"];

/// Options of cargo that leave out what the command does not need: recordings, demonstrations and the graphics device take as long to compile as half of
/// all else. Builds with and without them stand beside each other in the target folder.
fn features(command: &str, args: &[String]) -> Vec<&'static str> {
    let has = |option: &str| args.iter().any(|arg| arg == option || arg.starts_with(&format!("{option}=")));
    let mut options = vec!["--no-default-features"];
    if command == "replay" || has("--record") || has("--recording") {
        options.extend(["--features", "recording"]);
    }
    if command == "view" {
        options.extend(["--features", if has("--live") { "view,live" } else { "view" }]);
    }
    if command == "demos" || command == "view" && has("--demos") {
        options.extend(["--features", "demos"]);
    }
    if command == "export-tree" {
        options.extend(["--features", "gltf"]);
    }
    if ["gpu-info", "validate"].contains(&command) || has("--backend") {
        options.extend(["--features", "gpu"]);
    }
    options
}

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
    let features = if package == "orchardbench" { features(command, &args) } else { Vec::new() };
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.toml");
    let status = Command::new(cargo)
        .args(["run", "--quiet", "--package", package, "--profile", profile, "--manifest-path"])
        .arg(manifest)
        .args(&features)
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
