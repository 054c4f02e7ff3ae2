//! The ways in which a command can fail, with their exit codes.

use std::process::ExitCode;

/// Why a command did not succeed; displayed in one line, except that a cause may add its own.
#[derive(Debug)]
pub enum Failure {
    /// The user asked for something impossible: exit code 2.
    BadInput(String),
    /// Something went wrong, or a check failed: exit code 1.
    Failed(String),
    /// Ctrl-C: exit code 130.
    Interrupted(String),
}

impl Failure {
    /// The process exit code.
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Failure::BadInput(_) => 2,
            Failure::Failed(_) => 1,
            Failure::Interrupted(_) => 130,
        })
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Failure::BadInput(line) | Failure::Failed(line) | Failure::Interrupted(line) => f.write_str(line),
        }
    }
}

impl From<anyhow::Error> for Failure {
    fn from(e: anyhow::Error) -> Self {
        Failure::Failed(format!("{e:#}"))
    }
}

/// The outcome of a comparison with something that may not be there: other people's tools, a graphics device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// Both sides agree.
    Agreed,
    /// The comparison could not be made here; why.
    Skipped(String),
}
