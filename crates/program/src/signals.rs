//! The signals that ask a command to stop: Ctrl-C and, on Unix, SIGTERM, by which Slurm and Kubernetes end a job.
//!
//! The first sets a flag, the second ends the process. The exit code is 128 and the number of the signal: 130 for Ctrl-C, 143 for
//! SIGTERM. SIGHUP keeps its effect, so that `nohup` works.

/// Exit code of a process that Ctrl-C ended.
const CTRL_C: u8 = 130;

#[cfg(not(unix))]
pub use elsewhere::listen;
#[cfg(unix)]
pub use unix::listen;

/// Exit code of a command that a signal stopped.
pub fn exit_code() -> u8 {
    #[cfg(unix)]
    let code = unix::exit_code();
    #[cfg(not(unix))]
    let code = None;
    code.unwrap_or(CTRL_C)
}

#[cfg(unix)]
mod unix {
    use std::io;
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
    use std::sync::{Arc, OnceLock};

    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::flag;

    /// The flag, and the exit code of the last signal; 0 before any.
    #[derive(Default)]
    struct Signalled {
        stop: Arc<AtomicBool>,
        code: Arc<AtomicUsize>,
    }

    static SIGNALLED: OnceLock<Signalled> = OnceLock::new();

    /// Begins to listen; the first signal sets the flag.
    pub fn listen() -> io::Result<&'static AtomicBool> {
        if let Some(signalled) = SIGNALLED.get() {
            return Ok(&signalled.stop);
        }
        let signalled = SIGNALLED.get_or_init(Signalled::default);
        for signal in [SIGINT, SIGTERM] {
            let code = 128 + signal;
            // They act in this order, so that the first signal does not find its own flag.
            flag::register_conditional_shutdown(signal, code, signalled.stop.clone())?;
            flag::register_usize(signal, signalled.code.clone(), code as usize)?;
            flag::register(signal, signalled.stop.clone())?;
        }
        Ok(&signalled.stop)
    }

    pub fn exit_code() -> Option<u8> {
        let code = SIGNALLED.get()?.code.load(Ordering::Relaxed);
        u8::try_from(code).ok().filter(|code| *code > 0)
    }
}

#[cfg(not(unix))]
mod elsewhere {
    use std::io;
    use std::sync::atomic::{AtomicBool, Ordering};

    static STOP: AtomicBool = AtomicBool::new(false);

    /// Begins to listen; the first Ctrl-C sets the flag.
    pub fn listen() -> io::Result<&'static AtomicBool> {
        let handler = || {
            if STOP.swap(true, Ordering::Relaxed) {
                std::process::exit(super::CTRL_C.into());
            }
        };
        ctrlc::set_handler(handler).map_err(io::Error::other)?;
        Ok(&STOP)
    }
}
