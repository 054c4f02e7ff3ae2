//! LeRobot data sets, written by LeRobot itself through the Python package.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::failure::Failure;

/// Python module that converts a neutral folder.
const MODULE: &str = "orchardbench.lerobot";
/// Names the interpreter whose package runs the program, where one does.
const INTERPRETER: &str = "ORCHARD_PYTHON";

/// A Python that can convert.
pub struct Converter {
    python: String,
}

/// The neutral folder beside a LeRobot data set.
pub fn neutral_folder(out: &Path) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push("-neutral");
    PathBuf::from(name)
}

impl Converter {
    /// Finds Python with the package and LeRobot, before anything is computed.
    pub fn find(out: &Path) -> Result<Self, Failure> {
        if out.exists() {
            let problem = "exists; LeRobot writes into a new folder";
            return Err(Failure::BadInput(format!("--out {}: {problem}", out.display())));
        }
        let python = std::env::var(INTERPRETER)
            .unwrap_or_else(|_| if cfg!(windows) { "python".to_owned() } else { "python3".to_owned() });
        let check = Command::new(&python)
            .args(["-m", MODULE, "--check"])
            .stdin(Stdio::null())
            .output()
            .map_err(|e| Failure::BadInput(format!("--format lerobot needs Python: {python}: {e}")))?;
        if check.status.success() {
            return Ok(Self { python });
        }
        let said = String::from_utf8_lossy(&check.stderr);
        let last = said.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("no message");
        Err(Failure::BadInput(format!(
            "--format lerobot needs the Python package with LeRobot, `pip install 'orchardbench[lerobot]'`; {python} says: {}",
            last.trim()
        )))
    }

    /// Converts a neutral folder.
    pub fn convert(&self, neutral: &Path, out: &Path) -> Result<(), Failure> {
        let status = Command::new(&self.python).args(["-m", MODULE]).arg(neutral).arg(out).status();
        match status {
            Ok(status) if status.success() => {
                say!("LeRobot data set: {}", out.display());
                Ok(())
            }
            Ok(status) => Err(Failure::Failed(format!("{MODULE} ended with {status}"))),
            Err(e) => Err(Failure::Failed(format!("cannot run {}: {e}", self.python))),
        }
    }
}
