//! `cargo xtask check-python`: the Python package, checked by Gymnasium and against itself.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Context;

use crate::{python, workspace};
use orchard_program::{Failure, Verdict};

/// Builds the Python package without optimisation and runs tests/python/check.py on it: Gymnasium's checkers, one environment against many,
/// resets, snapshots, bad input, types.
#[derive(clap::Args)]
#[command(
    after_help = "Takes 16 s on two cores once it is built, 14 s of them for the types. Needs python3 with venv, and the network on the first run: gymnasium is installed into target/python/venv.\n\
                  If they are missing, the check is skipped with a message; with CI=true in the environment it fails.\n\
                  The package as checked is in target/python/package."
)]
pub struct Args {}

/// Folder of the script and of the last run's output.
const SUITE: &str = "python";
/// The script of a suite that checks.
pub const SCRIPT: &str = "check.py";
/// Cargo's package, which no other check builds.
pub const PACKAGE: &str = "orchard-python";
/// Folder of its Python half.
const SOURCE: &str = "crates/python/python/orchardbench";

pub fn run(_: &Args) -> Result<(), Failure> {
    if let Verdict::Skipped(reason) = check()? {
        eprintln!("SKIPPED: the Python package is not checked: {reason}");
    }
    Ok(())
}

/// Builds and checks; `Skipped` gives the reason why it cannot.
pub fn check() -> Result<Verdict, Failure> {
    let environment = match python::environment(SUITE)? {
        Ok(environment) => environment,
        Err(skipped) => return Ok(skipped),
    };
    let package = build(&[])?;
    ran(environment.script(SCRIPT).env("PYTHONPATH", &package).current_dir(&package))
}

/// Runs a script of a suite; it must succeed.
pub fn ran(script: &mut Command) -> Result<Verdict, Failure> {
    match script.status() {
        Ok(status) if status.success() => Ok(Verdict::Agreed),
        Ok(status) => Err(Failure::Failed(format!("{SCRIPT} ended with {status}"))),
        Err(e) => Err(Failure::Failed(format!("cannot run {SCRIPT}: {e}"))),
    }
}

/// Builds the package, and other packages of Cargo beside it; returns the folder to import it from.
pub fn build(beside: &[&str]) -> Result<PathBuf, Failure> {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    // The tools are named for their features, which are those of all builds here.
    let built = Command::new(program)
        .args(["build", "--quiet", "--package", PACKAGE, "--package", "devtools"])
        .args(beside.iter().flat_map(|name| ["--package", name]))
        .current_dir(workspace::root())
        .status();
    if !built.is_ok_and(|status| status.success()) {
        return Err(Failure::Failed("the Python package cannot be built".into()));
    }
    Ok(assemble(&workspace::root())?)
}

/// Puts both halves of the package into one folder, as a wheel does; returns the folder to import from.
fn assemble(root: &Path) -> anyhow::Result<PathBuf> {
    let folder = python::folder(SUITE).join("package");
    let package = folder.join("orchardbench");
    // Files of an earlier version of the code.
    if package.exists() {
        std::fs::remove_dir_all(&package).with_context(|| package.display().to_string())?;
    }
    std::fs::create_dir_all(&package).with_context(|| package.display().to_string())?;
    let (prefix, suffix, name) = match () {
        () if cfg!(windows) => ("", "dll", "_native.pyd"),
        () if cfg!(target_os = "macos") => ("lib", "dylib", "_native.abi3.so"),
        () => ("lib", "so", "_native.abi3.so"),
    };
    let library = workspace::target().join("debug").join(format!("{prefix}orchard_python.{suffix}"));
    let mut files = vec![(library, name.to_owned())];
    for file in std::fs::read_dir(root.join(SOURCE)).context(SOURCE)? {
        let file = file.context(SOURCE)?;
        if file.path().is_file() {
            files.push((file.path(), file.file_name().to_string_lossy().into_owned()));
        }
    }
    for (from, name) in files {
        std::fs::copy(&from, package.join(name)).with_context(|| from.display().to_string())?;
    }
    Ok(folder)
}
