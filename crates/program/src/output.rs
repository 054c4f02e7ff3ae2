//! Output of the program: results on the standard output, notes on the error output.
//!
//! An error output that cannot be written changes nothing. A standard output that cannot be written does not stop a run either, but the
//! command then ends with an error, unless its reader closed the pipe.

use std::fmt::{Arguments, Display};
use std::io::{self, ErrorKind, Write};
use std::sync::{Mutex, PoisonError};

/// First error of the standard output since [`check`] was last called.
static FAILED: Mutex<Option<io::Error>> = Mutex::new(None);

/// Prints a line on the standard output.
#[macro_export]
#[doc(hidden)]
macro_rules! say {
    ($($text:tt)*) => { $crate::output::line(format_args!($($text)*)) };
}

/// Prints a line on the error output.
#[macro_export]
#[doc(hidden)]
macro_rules! note {
    ($($text:tt)*) => { $crate::output::note(format_args!($($text)*)) };
}

/// Prints a line on the standard output.
pub fn line(text: Arguments) {
    let written = writeln!(io::stdout(), "{}", Lines(&text.to_string()));
    keep(written);
}

/// Prints a line on the error output.
pub fn note(text: Arguments) {
    // There is nowhere left to report an error of the error output.
    let _ = writeln!(io::stderr(), "{}", Lines(&text.to_string()));
}

/// Writes the last bytes of the standard output.
///
/// # Errors
/// The standard output could not be written since the last call, for another reason than a reader that closed the pipe.
pub fn check() -> io::Result<()> {
    keep(io::stdout().flush());
    match FAILED.lock().unwrap_or_else(PoisonError::into_inner).take() {
        None => Ok(()),
        Some(e) => Err(e),
    }
}

fn keep(written: io::Result<()>) {
    if let Err(e) = written
        && e.kind() != ErrorKind::BrokenPipe
    {
        FAILED.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(e);
    }
}

/// Text whose control characters are shown as escapes such as `\u{1b}`, line breaks and tabs as well: a file may have any name.
pub struct Escaped<'a>(pub &'a str);

/// Text whose control characters but line breaks and tabs are shown as escapes.
struct Lines<'a>(&'a str);

impl Display for Escaped<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write(f, self.0, is_control)
    }
}

impl Display for Lines<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write(f, self.0, |c| is_control(c) && !matches!(c, '\n' | '\t'))
    }
}

fn write(f: &mut std::fmt::Formatter<'_>, text: &str, escaped: impl Fn(char) -> bool) -> std::fmt::Result {
    text.chars()
        .try_for_each(|c| if escaped(c) { write!(f, "{}", c.escape_default()) } else { write!(f, "{c}") })
}

/// True for characters that move the cursor or change a terminal, and for those that change the direction of the text after them.
fn is_control(c: char) -> bool {
    c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped() {
        assert_eq!(Escaped("a\x1b[2Jb\nc\u{202e}é").to_string(), "a\\u{1b}[2Jb\\nc\\u{202e}é");
        assert_eq!(Lines("a\x1b\nb\tc\r").to_string(), "a\\u{1b}\nb\tc\\r");
    }
}
