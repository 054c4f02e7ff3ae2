//! What tests see of a run: what it tells on the way, and the files that it leaves.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::task::Progress;

/// Counts what a run tells.
#[derive(Default)]
pub struct Heard {
    steps: AtomicU32,
    computed: AtomicU32,
    reused: AtomicU32,
    notes: Mutex<Vec<String>>,
}

impl<R> Progress<R> for Heard {
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

impl Heard {
    /// Records computed, and records reused.
    pub fn counts(&self) -> (u32, u32) {
        (self.computed.load(Ordering::Relaxed), self.reused.load(Ordering::Relaxed))
    }

    pub fn steps(&self) -> u32 {
        self.steps.load(Ordering::Relaxed)
    }

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
