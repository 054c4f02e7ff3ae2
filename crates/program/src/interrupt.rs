//! A flag that a signal sets, for commands that stop with complete files.

use std::sync::atomic::AtomicBool;

use crate::failure::Failure;
use crate::signals;

/// Listens to Ctrl-C and, on Unix, SIGTERM; the first sets the flag.
pub fn listen() -> Result<&'static AtomicBool, Failure> {
    signals::listen().map_err(|e| Failure::Failed(format!("cannot install the signal handlers: {e}")))
}
