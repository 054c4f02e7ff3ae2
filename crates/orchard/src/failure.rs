//! The ways in which a command can fail, with their exit codes.

use std::process::ExitCode;

/// Reason for a command's failure; displayed in one line, except that a cause may add lines.
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

/// Outcome of a comparison with something that may be missing: a third-party tool, a graphics device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// Both sides agree.
    Agreed,
    /// The comparison could not be made; holds the reason.
    Skipped(String),
}
