//! `cargo xtask check-network`: networks in ONNX format against ONNX Runtime, and their bits here against those in WebAssembly.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use orchard_bench::store::write_bytes;

use crate::{python, workspace};
use orchard_program::{Failure, Verdict};

/// Computes small networks of every operator and compares them with ONNX Runtime and with ONNX's reference implementation, then computes them in
/// WebAssembly, where every bit must be the same.
#[derive(clap::Args)]
#[command(
    after_help = "Needs python3 with venv, and the network on the first run: onnx and onnxruntime are installed into target/network/venv. For WebAssembly it needs node\n\
                  and Rust's target wasm32-wasip1 (rustup target add wasm32-wasip1). What is missing is skipped with a message; with CI=true in the\n\
                  environment missing packages fail. Networks and outputs of the last run are in target/network."
)]
pub struct Args {}

/// Folder of the scripts and of the last run's output.
const SUITE: &str = "network";
/// The program that computes a folder of networks, and Rust's name of WebAssembly.
const PROGRAM: &str = "outputs";
const WASM: &str = "wasm32-wasip1";

pub fn run(_: &Args) -> Result<(), Failure> {
    if let Verdict::Skipped(reason) = check()? {
        eprintln!("SKIPPED: {reason}");
    }
    Ok(())
}

/// Compares; `Skipped` says what is missing.
pub fn check() -> Result<Verdict, Failure> {
    let environment = match python::environment(SUITE)? {
        Ok(environment) => environment,
        Err(skipped) => return Ok(skipped),
    };
    let folder = python::folder(SUITE).join("networks");
    succeeded("models.py", environment.script("models.py").arg(&folder))?;
    let mut here = Command::new(build(None)?);
    let here = succeeded(PROGRAM, here.arg(&folder))?.stdout;
    let written = python::folder(SUITE).join("outputs.txt");
    write_bytes(&written, &here).map_err(|e| Failure::Failed(e.to_string()))?;
    environment.compare("compare.py", &[folder.clone(), written])?;
    match in_wasm(&folder) {
        Ok(there) => match there? == here {
            true => {
                eprintln!("WebAssembly: the same bits");
                Ok(Verdict::Agreed)
            }
            false => Err(Failure::Failed("WebAssembly gives other bits than this processor".into())),
        },
        Err(missing) => Ok(Verdict::Skipped(format!("no comparison with WebAssembly: {missing} is missing"))),
    }
}

/// Runs the program in WebAssembly and returns what it prints; the error names what is missing for it.
fn in_wasm(folder: &Path) -> Result<Result<Vec<u8>, Failure>, &'static str> {
    if !workspace::has_target(WASM) {
        return Err("Rust's target wasm32-wasip1");
    }
    if Command::new("node").arg("--version").output().is_err() {
        return Err("node");
    }
    let run = || {
        let script = workspace::root().join("tests").join(SUITE).join("wasm.mjs");
        let mut node = Command::new("node");
        node.arg("--no-warnings").args([script, build(Some(WASM))?]).arg(folder);
        Ok(succeeded("wasm.mjs", &mut node)?.stdout)
    };
    Ok(run())
}

/// Builds the program, for a target; returns its file.
fn build(target: Option<&str>) -> Result<PathBuf, Failure> {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["build", "--quiet", "--package", "orchard-network", "--example", PROGRAM]);
    // Here, the tools are named for their features, which are those of all builds.
    match target {
        Some(target) => cargo.args(["--target", target]),
        None => cargo.args(["--package", "devtools"]),
    };
    let status = cargo.current_dir(workspace::root()).status();
    if !status.is_ok_and(|status| status.success()) {
        return Err(Failure::Failed(format!("the example {PROGRAM} cannot be built")));
    }
    let folder = workspace::target().join(target.unwrap_or_default()).join("debug/examples");
    let suffix = if target.is_some() { ".wasm" } else { std::env::consts::EXE_SUFFIX };
    Ok(folder.join(format!("{PROGRAM}{suffix}")))
}

/// Runs a command that must succeed; what it says of problems is shown.
fn succeeded(name: &str, command: &mut Command) -> Result<Output, Failure> {
    let output = command.output().map_err(|e| Failure::Failed(format!("cannot run {name}: {e}")))?;
    if output.status.success() {
        return Ok(output);
    }
    let said = String::from_utf8_lossy(&output.stderr);
    Err(Failure::Failed(format!("{name} ended with {}: {}", output.status, said.trim())))
}
