//! The ways in which a command can fail, with their exit codes.

use std::process::ExitCode;

use clap::error::ErrorKind;

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

/// The first paragraph of a parser's message as one line.
fn one_line(message: &str) -> String {
    let paragraph = message.split("\n\n").next().unwrap_or_default();
    let words: Vec<&str> = paragraph.split_whitespace().collect();
    format!("{} (--help tells more)", words.join(" ").trim_start_matches("error: "))
}
