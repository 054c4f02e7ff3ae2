//! Ctrl-C: the first asks the command to end with whole files, the second ends it.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::failure::Failure;

/// Raised by Ctrl-C.
static STOP: AtomicBool = AtomicBool::new(false);

/// Listens to Ctrl-C from now on; the flag is raised by the first.
pub fn listen() -> Result<&'static AtomicBool, Failure> {
    ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .map_err(|e| Failure::Failed(format!("cannot listen to Ctrl-C: {e}")))?;
    Ok(&STOP)
}
