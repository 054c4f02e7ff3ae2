//! Python virtual environments with pinned packages, one per suite, for third-party tools.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use orchard_bench::store::write_bytes;

use crate::workspace;
use orchard_program::{Failure, Verdict};

/// An installed environment.
pub struct Environment {
    python: PathBuf,
    /// Folder of the scripts.
    source: PathBuf,
}

/// Folder of a suite's environment and of its last run's output.
pub fn folder(suite: &str) -> PathBuf {
    workspace::target().join(suite)
}

/// Folder of a suite's scripts and pinned packages.
fn source(suite: &str) -> PathBuf {
    workspace::root().join("tests").join(suite)
}

/// Returns the environment of a suite, or the reason why it is missing. In continuous integration that is a failure.
pub fn environment(suite: &str) -> Result<Result<Environment, Verdict>, Failure> {
    match Environment::install(suite) {
        Ok(environment) => Ok(Ok(environment)),
        Err(reason) if std::env::var_os("CI").is_some_and(|ci| ci == "true") => Err(Failure::Failed(
            format!("the packages of tests/{suite} are needed in continuous integration: {reason}"),
        )),
        Err(reason) => Ok(Err(Verdict::Skipped(reason))),
    }
}

impl Environment {
    /// Makes the virtual environment `target/SUITE/venv` with the packages that `tests/SUITE/requirements.txt` pins,
    /// unless it is there already. The error gives the reason why they are missing.
    pub fn install(suite: &str) -> Result<Self, String> {
        Self::install_from(&source(suite), "requirements.txt", &folder(suite))
    }

    /// Installs an additional environment of a suite: the packages of `tests/SUITE/requirements-PART.txt` in
    /// `target/SUITE-PART/venv`.
    pub fn install_part(suite: &str, part: &str) -> Result<Self, String> {
        let requirements = format!("requirements-{part}.txt");
        Self::install_from(&source(suite), &requirements, &folder(&format!("{suite}-{part}")))
    }

    fn install_from(source: &Path, requirements: &str, folder: &Path) -> Result<Self, String> {
        let requirements = source.join(requirements);
        let wanted = std::fs::read(&requirements).map_err(|e| format!("{}: {e}", requirements.display()))?;
        let (venv, installed) = (folder.join("venv"), folder.join("installed.txt"));
        let binaries = if cfg!(windows) { "Scripts" } else { "bin" };
        let environment = Self { python: venv.join(binaries).join("python"), source: source.to_owned() };
        // Written last, so that an incomplete installation is repeated.
        if environment.python.exists() && std::fs::read(&installed).is_ok_and(|text| text == wanted) {
            return Ok(environment);
        }
        eprintln!("installing pinned packages into {}", venv.display());
        let mut install = environment.make(&venv)?;
        install.args(["install", "--quiet", "--disable-pip-version-check"]);
        // Wheels in the script's folder are used instead of the network.
        let wheels = source.join("wheels");
        if wheels.is_dir() {
            install.args(["--no-index", "--find-links"]).arg(&wheels);
        }
        quiet(install.arg("-r").arg(&requirements), "cannot install the pinned packages")?;
        write_bytes(&installed, &wanted).map_err(|e| e.to_string())?;
        Ok(environment)
    }

    /// Makes an empty environment and returns its pip.
    fn make(&self, venv: &Path) -> Result<Command, String> {
        let make = |options: &[&str]| {
            let mut make = Command::new("python3");
            make.args(["-m", "venv", "--clear"]).args(options).arg(venv);
            quiet(&mut make, "cannot create a virtual environment")
        };
        if make(&[]).is_ok() {
            let mut pip = Command::new(&self.python);
            pip.args(["-m", "pip"]);
            return Ok(pip);
        }
        // Some Pythons cannot install pip into it; their own pip is used.
        make(&["--without-pip"])?;
        let mut pip = Command::new("python3");
        pip.args(["-m", "pip", "--python"]).arg(&self.python);
        Ok(pip)
    }

    /// A command that runs a script of the suite.
    pub fn script(&self, name: &str) -> Command {
        let mut command = Command::new(&self.python);
        command.arg(self.source.join(name));
        command
    }

    /// A command that runs a module of an installed package.
    pub fn module(&self, name: &str) -> Command {
        let mut command = Command::new(&self.python);
        command.args(["-m", name]);
        command
    }

    /// Folder of the environment's programs, `python` among them.
    pub fn programs(&self) -> &Path {
        self.python.parent().unwrap_or(&self.python)
    }

    /// Runs a script that compares the cases.
    pub fn compare(&self, script: &str, cases: &[PathBuf]) -> Result<(), Failure> {
        match self.script(script).args(cases).status() {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(Failure::Failed(format!("{script} ended with {status}"))),
            Err(e) => Err(Failure::Failed(format!("cannot run {}: {e}", self.python.display()))),
        }
    }
}

/// Runs a command; the error is the last line of its output.
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
