//! Devices for tests, and a record of the tests that are skipped where there is no adapter. The unit tests of this crate and the suites of `orchard-tests` and `orchard-lockstep` include this file; it is no part of the library, which reads
//! no environment and opens no file.

use std::fs::OpenOptions;
use std::io::Write;
use std::ops::Deref;
use std::panic::Location;
use std::sync::Mutex;

use orchard_gpu::{Choice, Gpu, GpuError};

/// Environment variable that names the file to which every skipped test appends a line. An absolute path: `cargo test` runs each crate's tests in that crate's folder.
const SKIPPED_FILE: &str = "ORCHARD_SKIPPED";

/// Devices that no test has at the moment. Kernels are compiled once for each device, not for every test; a driver in software works off the commands of one device one after the other.
static FREE: Mutex<Vec<Gpu>> = Mutex::new(Vec::new());

/// A device that a test has for itself until it ends.
pub struct OwnDevice(Gpu);

impl Deref for OwnDevice {
    type Target = Gpu;

    fn deref(&self) -> &Gpu {
        &self.0
    }
}

impl Drop for OwnDevice {
    fn drop(&mut self) {
        // The next test would inherit what made this one fail.
        if !std::thread::panicking() {
            free().push(self.0.clone());
        }
    }
}

/// The free devices, also after a test that failed while it took one.
fn free() -> std::sync::MutexGuard<'static, Vec<Gpu>> {
    FREE.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// A device that no other test has now: one that another test has left, or a new one; `None` if the computer has no graphics adapter. A test that breaks its device opens one of its own. Without an adapter the test returns, and counts as skipped:
/// the line `skipped, no adapter: TEST (FILE:LINE)` goes to standard error, which `cargo test` does not capture, and is appended to the file that the environment variable `ORCHARD_SKIPPED` names, if that is
/// set. The number of lines in that file is the number of skipped tests.
///
/// Under continuous integration, that is with a variable `CI` that is not empty, a missing adapter fails the test instead.
///
/// # Panics
/// There is no adapter and `CI` is set, the adapter cannot be used, or the file cannot be written.
#[track_caller]
pub fn device() -> Option<OwnDevice> {
    let left = free().pop();
    match left.map_or_else(|| Gpu::open(Choice::Any), Ok) {
        Ok(gpu) => Some(OwnDevice(gpu)),
        Err(GpuError::NoAdapter(why)) => {
            let is_ci = std::env::var_os("CI").is_some_and(|ci| !ci.is_empty());
            assert!(!is_ci, "no graphics adapter, and CI is set: {why}");
            skip(&test_name(Location::caller()));
            None
        }
        Err(e) => panic!("{e}"),
    }
}

/// Name of the running test and the place that asked for a device. The test harness names the threads of tests after them, unless it runs them one by one.
fn test_name(place: &Location<'_>) -> String {
    let thread = std::thread::current();
    format!("{} ({}:{})", thread.name().unwrap_or("unnamed"), place.file(), place.line())
}

fn skip(test: &str) {
    let line = format!("skipped, no adapter: {test}\n");
    // The macros' output is captured by the test harness, a direct write is not.
    std::io::stderr().write_all(line.as_bytes()).unwrap();
    if let Some(path) = std::env::var_os(SKIPPED_FILE).filter(|path| !path.is_empty()) {
        // One write in append mode: lines of several processes stay whole.
        let mut file = OpenOptions::new().create(true).append(true).open(path).unwrap();
        file.write_all(line.as_bytes()).unwrap();
    }
}
