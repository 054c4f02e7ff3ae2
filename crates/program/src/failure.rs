//! Kinds of failure of a command, with their exit codes.

use std::io;
use std::process::ExitCode;

use clap::error::ErrorKind;

use crate::output::{self, Escaped};
use crate::signals;

/// The exit codes, for `--help`.
pub const EXIT_CODES: &str = "\
Exit codes:\n  0    done\n  \
1    something went wrong: a check failed, or a file or the standard output cannot be written, as on a full disk\n  \
2    bad input: an option, or a file that it names, cannot be used; nothing was computed\n  \
3    a requirement that an option states is not met: `robot check --require-harvest`\n  \
130  Ctrl-C\nWhat cannot be written to the error output is lost and changes nothing.";

/// Failure of a command. It is displayed in one line; a cause may add lines. Control characters are escaped.
#[derive(Debug)]
pub enum Failure {
    /// Invalid input of the user: exit code 2.
    BadInput(String),
    /// An error during the run, or a failed check: exit code 1.
    Failed(String),
    /// A requirement that the user stated is not met: exit code 3.
    Unmet(String),
    /// Interrupted by Ctrl-C (exit code 130) or SIGTERM (exit code 143).
    Interrupted(String),
}

impl Failure {
    /// Returns the failure of a command line that does not parse. A call for help or for the version is answered, and ends the process.
    pub fn of_command_line(e: &clap::Error) -> Self {
        if !e.use_stderr() || e.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
            match e.print() {
                Err(cause) if !e.use_stderr() && cause.kind() != io::ErrorKind::BrokenPipe => {
                    return unwritten(&cause);
                }
                _ => std::process::exit(e.exit_code()),
            }
        }
        Self::BadInput(one_line(&e.to_string()))
    }

    /// Returns the failure of a file that could not be written: [`Failure::Failed`] if the disk is full, else bad input, since the user
    /// named the file.
    pub fn of_file(e: &(dyn std::error::Error + 'static)) -> Self {
        let causes = std::iter::successors(Some(e), |e| e.source());
        let mut causes = causes.filter_map(|e| e.downcast_ref::<io::Error>());
        match causes.any(|e| is_full(e.kind())) {
            true => Self::Failed(e.to_string()),
            false => Self::BadInput(e.to_string()),
        }
    }

    /// Returns the failure with a prefix that names the option or file.
    #[must_use]
    pub fn at(self, place: impl std::fmt::Display) -> Self {
        match self {
            Self::BadInput(line) => Self::BadInput(format!("{place}: {line}")),
            Self::Failed(line) => Self::Failed(format!("{place}: {line}")),
            Self::Unmet(line) => Self::Unmet(format!("{place}: {line}")),
            Self::Interrupted(line) => Self::Interrupted(format!("{place}: {line}")),
        }
    }

    /// Prints the error of a command, if there is one, and returns the exit code of the process. A standard output that could not be
    /// written is an error.
    pub fn finish(result: Result<(), Self>) -> ExitCode {
        ExitCode::from(Self::finish_code(result))
    }

    /// [`Self::finish`], with the exit code as a number.
    pub fn finish_code(result: Result<(), Self>) -> u8 {
        match result.and_then(|()| output::check().map_err(|e| unwritten(&e))) {
            Ok(()) => 0,
            Err(failure) => {
                note!("error: {failure}");
                failure.code()
            }
        }
    }

    /// The process exit code.
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(self.code())
    }

    fn code(&self) -> u8 {
        match self {
            Failure::BadInput(_) => 2,
            Failure::Failed(_) => 1,
            Failure::Unmet(_) => 3,
            Failure::Interrupted(_) => signals::exit_code(),
        }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Failure::BadInput(line) | Failure::Unmet(line) => write!(f, "{}", Escaped(line)),
            Failure::Failed(text) | Failure::Interrupted(text) => {
                let mut lines = text.split('\n');
                write!(f, "{}", Escaped(lines.next().unwrap_or_default()))?;
                // Set in, so that no line of a cause passes for one of ours.
                lines.try_for_each(|line| write!(f, "\n  {}", Escaped(line)))
            }
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

/// Failure of a standard output that cannot be written.
fn unwritten(e: &io::Error) -> Failure {
    Failure::Failed(format!("cannot write to the standard output: {e}"))
}

fn is_full(kind: io::ErrorKind) -> bool {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    matches!(kind, StorageFull | QuotaExceeded | FileTooLarge)
}

/// The first paragraph of a parser's message as one line.
fn one_line(message: &str) -> String {
    let paragraph = message.split("\n\n").next().unwrap_or_default();
    let words: Vec<&str> = paragraph.split_whitespace().collect();
    format!("{} (see --help)", words.join(" ").trim_start_matches("error: "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_bench::store::StoreError;

    #[test]
    fn a_full_disk_has_one_exit_code() {
        let error = |kind: io::ErrorKind| StoreError::new("a".as_ref(), kind.into());
        assert!(matches!(Failure::of_file(&error(io::ErrorKind::StorageFull)), Failure::Failed(_)));
        assert!(matches!(Failure::of_file(&error(io::ErrorKind::PermissionDenied)), Failure::BadInput(_)));
        assert!(matches!(Failure::of_file(&io::Error::from_raw_os_error(28)), Failure::Failed(_)));
    }

    #[test]
    fn control_characters_are_escaped() {
        assert_eq!(Failure::BadInput("no\x1b[2J\nok".into()).to_string(), "no\\u{1b}[2J\\nok");
        assert_eq!(Failure::Failed("no\r\nok".into()).to_string(), "no\\r\n  ok");
    }
}
