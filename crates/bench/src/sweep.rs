//! Runs a command once for every fault at every operation of the store, for tests.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs;
use std::path::Path;

use crate::disk::is_half_written;
use crate::faults::{Fault, Kind, Operation, Watch};
use crate::lock::LOCK_FILE;

/// A command that writes a result, for [`Scenario::sweep`].
pub struct Scenario<'a, E> {
    /// Brings a new folder into the state that the command finds.
    pub prepare: &'a dyn Fn(&Path),
    /// The command, which writes into the folder on one thread.
    pub run: &'a dyn Fn(&Path) -> Result<(), E>,
    /// Files that tell that a result is whole.
    pub last: &'a [&'a str],
    /// Files that follow from the others and are written before them: they may be newer than an older result that counts until it is
    /// replaced.
    pub derived: &'a [&'a str],
    /// Files that depend on a clock.
    pub timed: &'a [&'a str],
}

impl<E: Display> Scenario<'_, E> {
    /// Lets every fault happen at every operation, each in a new folder. Returns the number of operations of an undisturbed run.
    ///
    /// # Panics
    /// If a faulty run succeeds with other bytes than an undisturbed one, or leaves a file under its final name that is not
    /// whole, or leaves a result that looks whole and is not; if a second run fails, or gives other bytes.
    pub fn sweep(&self) -> usize {
        let (expected, operations) = self.faulty(None);
        for (at, operation) in operations.iter().enumerate() {
            let kinds: &[Kind] = match operation {
                Operation::Write => &[Kind::Fail, Kind::ShortWrite, Kind::Crash],
                _ => &[Kind::Fail, Kind::Crash],
            };
            for kind in kinds {
                self.faulty(Some((Fault { kind: *kind, at }, &expected)));
            }
        }
        operations.len()
    }

    /// Runs with a fault, checks what is left, and runs again.
    fn faulty(&self, fault: Option<(Fault, &Files)>) -> (Files, Vec<Operation>) {
        let place = tempfile::tempdir().unwrap_or_else(|e| panic!("{e}"));
        let folder = place.path().join("out");
        (self.prepare)(&folder);
        let before = self.files(&folder);
        let watch = Watch::begin(place.path(), fault.map(|(fault, _)| fault));
        let result = (self.run)(&folder).map_err(|e| e.to_string());
        let operations = watch.operations();
        drop(watch);
        let files = self.files(&folder);
        let Some((fault, expected)) = fault else {
            assert_eq!(result, Ok(()), "undisturbed");
            return (files, operations);
        };
        for (name, bytes) in &files {
            let whole = expected.get(name) == Some(bytes) || before.get(name) == Some(bytes);
            assert!(whole, "{fault:?}: {name} is not whole ({result:?})");
        }
        // An older result that is still there in full is whole.
        let looks_whole =
            self.own(&files) != self.own(&before) && self.last.iter().any(|name| files.contains_key(*name));
        if result.is_ok() || looks_whole {
            assert_eq!(names(&files), names(expected), "{fault:?}: looks whole ({result:?})");
            assert!(files == *expected, "{fault:?}: looks whole ({result:?})");
        }
        let again = (self.run)(&folder).map_err(|e| e.to_string());
        assert_eq!(again, Ok(()), "{fault:?}: the second run");
        let files = self.files(&folder);
        assert_eq!(names(&files), names(expected), "{fault:?}: the second run");
        assert!(files == *expected, "{fault:?}: the second run gives other bytes");
        let left = all_files(&folder);
        let left = left.keys().find(|name| is_half(name));
        assert_eq!(left, None, "{fault:?}: the second run leaves a half-written file");
        (files, operations)
    }

    /// The files of a result that do not follow from others.
    fn own<'f>(&self, files: &'f Files) -> Vec<(&'f String, &'f Vec<u8>)> {
        files.iter().filter(|(name, _)| !self.derived.contains(&name.as_str())).collect()
    }

    /// The files that are compared.
    fn files(&self, folder: &Path) -> Files {
        let mut files = all_files(folder);
        files.retain(|name, _| !is_half(name) && name != LOCK_FILE && !self.timed.contains(&name.as_str()));
        files
    }
}

/// Bytes of files by their path under a folder.
type Files = BTreeMap<String, Vec<u8>>;

fn names(files: &Files) -> Vec<&String> {
    files.keys().collect()
}

fn is_half(name: &str) -> bool {
    Path::new(name).file_name().is_some_and(is_half_written)
}

fn all_files(root: &Path) -> Files {
    let mut files = Files::new();
    let mut open = vec![root.to_owned()];
    while let Some(folder) = open.pop() {
        for path in fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                open.push(path);
            } else if let (Ok(name), Ok(bytes)) = (path.strip_prefix(root), fs::read(&path)) {
                files.insert(name.to_string_lossy().replace('\\', "/"), bytes);
            }
        }
    }
    files
}
