//! Processor time of a thread and of the program.

use std::time::Duration;

#[cfg(unix)]
fn time(clock: rustix::time::ClockId) -> Duration {
    let time = rustix::time::clock_gettime(clock);
    Duration::new(time.tv_sec.max(0) as u64, time.tv_nsec.max(0) as u32)
}

/// Processor time that this thread has taken so far.
#[cfg(unix)]
pub fn thread_time() -> Duration {
    time(rustix::time::ClockId::ThreadCPUTime)
}

/// Processor time that all threads of this program have taken so far.
#[cfg(unix)]
pub fn program_time() -> Duration {
    time(rustix::time::ClockId::ProcessCPUTime)
}

/// Time since the first call: this system tells none of a program.
#[cfg(not(unix))]
pub fn program_time() -> Duration {
    thread_time()
}

/// Time since the first call: this system tells none of a thread.
#[cfg(not(unix))]
pub fn thread_time() -> Duration {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed()
}
