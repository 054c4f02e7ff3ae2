//! Test fixtures for runs: a progress that counts, and the files that a run leaves.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

use orchard_bench::task::Progress;

/// Counts the calls of a run.
#[derive(Default)]
pub struct CountingProgress {
    steps: AtomicU32,
    computed: AtomicU32,
    reused: AtomicU32,
    notes: Mutex<Vec<String>>,
}

impl<R> Progress<R> for CountingProgress {
    fn step(&self) {
        self.steps.fetch_add(1, Ordering::Relaxed);
    }

    fn record(&self, _: &R, reused: bool) {
        let counter = if reused { &self.reused } else { &self.computed };
        counter.fetch_add(1, Ordering::Relaxed);
    }

    fn note(&self, line: &str) {
        self.notes.lock().unwrap().push(line.to_owned());
    }
}

impl CountingProgress {
    /// Records computed, and records reused.
    pub fn counts(&self) -> (u32, u32) {
        (self.computed.load(Ordering::Relaxed), self.reused.load(Ordering::Relaxed))
    }

    /// Steps.
    pub fn steps(&self) -> u32 {
        self.steps.load(Ordering::Relaxed)
    }

    /// Notes, in order.
    pub fn notes(&self) -> Vec<String> {
        self.notes.lock().unwrap().clone()
    }
}

/// Texts of the files in a result folder and in its folder of records, by name; without the one that a clock may change.
pub fn files(folder: &Path, records: &str) -> BTreeMap<String, String> {
    let mut files = BTreeMap::new();
    for dir in [folder.to_owned(), folder.join(records)] {
        for entry in fs::read_dir(dir).unwrap().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if entry.path().is_file() && name != "compute.json" {
                files.insert(name, fs::read_to_string(entry.path()).unwrap());
            }
        }
    }
    files
}
