//! Ctrl-C handling: the first makes the command stop with complete files, the second ends the process at once.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::failure::Failure;

/// Flag that is set by Ctrl-C.
static STOP: AtomicBool = AtomicBool::new(false);

/// Installs the Ctrl-C handler; the first Ctrl-C sets the flag.
pub fn listen() -> Result<&'static AtomicBool, Failure> {
    ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .map_err(|e| Failure::Failed(format!("cannot install the Ctrl-C handler: {e}")))?;
    Ok(&STOP)
}
