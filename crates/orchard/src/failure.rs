//! Kinds of failure of a command, with their exit codes.

use std::process::ExitCode;

/// Failure of a command. It is displayed in one line; a cause may add lines.
#[derive(Debug)]
pub enum Failure {
    /// Invalid input of the user: exit code 2.
    BadInput(String),
    /// An error during the run, or a failed check: exit code 1.
    Failed(String),
    /// Interrupted by Ctrl-C: exit code 130.
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

/// Outcome of a comparison that needs a third-party tool or a graphics device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// Both sides agree.
    Agreed,
    /// The comparison could not be made; holds the reason.
    Skipped(String),
}
