//! The other side's environment: a Python virtual environment with the pinned packages.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use orchard_bench::store::write_bytes;

use crate::failure::Failure;

/// An installed judge.
pub struct Judge {
    python: PathBuf,
    script: PathBuf,
}

impl Judge {
    /// Makes the virtual environment `folder/venv` with the packages that `source/requirements.txt` pins, unless it
    /// is there already. The error says why MuJoCo cannot be had.
    pub fn install(source: &Path, folder: &Path) -> Result<Self, String> {
        let requirements = source.join("requirements.txt");
        let wanted = std::fs::read(&requirements).map_err(|e| format!("{}: {e}", requirements.display()))?;
        let (venv, installed) = (folder.join("venv"), folder.join("installed.txt"));
        let binaries = if cfg!(windows) { "Scripts" } else { "bin" };
        let judge = Self { python: venv.join(binaries).join("python"), script: source.join("judge.py") };
        // Written last: a broken installation is made anew.
        if judge.python.exists() && std::fs::read(&installed).is_ok_and(|text| text == wanted) {
            return Ok(judge);
        }
        eprintln!("installing MuJoCo into {}", venv.display());
        let mut make = Command::new("python3");
        quiet(make.args(["-m", "venv", "--clear"]).arg(&venv), "cannot make a virtual environment")?;
        let mut install = Command::new(&judge.python);
        install.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"]);
        quiet(install.arg(&requirements), "cannot install the pinned packages")?;
        write_bytes(&installed, &wanted).map_err(|e| e.to_string())?;
        Ok(judge)
    }

    /// Lets the judge compare.
    pub fn compare(&self, cases: &[PathBuf]) -> Result<(), Failure> {
        match Command::new(&self.python).arg(&self.script).args(cases).status() {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(Failure::Failed(format!("the judge ended with {status}"))),
            Err(e) => Err(Failure::Failed(format!("cannot run {}: {e}", self.python.display()))),
        }
    }
}

/// Runs a command; the error is the last line that it wrote.
fn quiet(command: &mut Command, problem: &str) -> Result<(), String> {
    let output = command.stdin(Stdio::null()).output().map_err(|e| format!("{problem}: {e}"))?;
    if output.status.success() {
        return Ok(());
    }
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    let last = said.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("no message");
    Err(format!("{problem}: {}", last.trim()))
}
