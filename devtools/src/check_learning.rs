//! `cargo xtask test --learning`: the adapters of the Python package, checked with the packages that they are for.

use crate::{check_python, python, workspace};
use orchard_program::{Failure, Verdict};

/// Folder of the script and of its environment.
const SUITE: &str = "learning";
/// The program `orchard`, which makes the demonstrations.
const PROGRAM: &str = "orchardbench";

/// Builds and checks; `Skipped` gives the reason why it cannot.
pub fn check() -> Result<Verdict, Failure> {
    let environment = match python::environment(SUITE)? {
        Ok(environment) => environment,
        Err(skipped) => return Ok(skipped),
    };
    let package = check_python::build(&[PROGRAM])?;
    let orchard = workspace::target().join("debug").join(format!("orchard{}", std::env::consts::EXE_SUFFIX));
    let mut script = environment.script(check_python::SCRIPT);
    check_python::ran(script.env("PYTHONPATH", &package).env("ORCHARD", orchard).current_dir(&package))
}
