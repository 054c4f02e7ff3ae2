//! Kinds of failure of a command, with their exit codes.

use std::process::ExitCode;

use clap::error::ErrorKind;

use crate::signals;

/// Failure of a command. It is displayed in one line; a cause may add lines.
#[derive(Debug)]
pub enum Failure {
    /// Invalid input of the user: exit code 2.
    BadInput(String),
    /// An error during the run, or a failed check: exit code 1.
    Failed(String),
    /// Interrupted by Ctrl-C (exit code 130) or SIGTERM (exit code 143).
    Interrupted(String),
}

impl Failure {
    /// Returns the failure of a command line that does not parse. A call for help or for the version is answered, and ends the process.
    pub fn of_command_line(e: &clap::Error) -> Self {
        if !e.use_stderr() || e.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
            e.exit();
        }
        Self::BadInput(one_line(&e.to_string()))
    }

    /// Prints the error of a command, if there is one, and returns the exit code of the process.
    pub fn finish(result: Result<(), Self>) -> ExitCode {
        match result {
            Ok(()) => ExitCode::SUCCESS,
            Err(failure) => {
                eprintln!("error: {failure}");
                failure.exit_code()
            }
        }
    }

    /// The process exit code.
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Failure::BadInput(_) => 2,
            Failure::Failed(_) => 1,
            Failure::Interrupted(_) => signals::exit_code(),
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

/// The first paragraph of a parser's message as one line.
fn one_line(message: &str) -> String {
    let paragraph = message.split("\n\n").next().unwrap_or_default();
    let words: Vec<&str> = paragraph.split_whitespace().collect();
    format!("{} (see --help)", words.join(" ").trim_start_matches("error: "))
}
