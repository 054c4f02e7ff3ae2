//! Faults of the disk, for tests: an operation fails, writes half of its bytes, or is the last one before the process dies.
//!
//! A fault belongs to a folder, so tests run side by side.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

/// An operation of the store that changes the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operation {
    /// Makes a folder.
    CreateFolder,
    /// Begins a temporary file.
    Begin,
    /// Writes the bytes of a file.
    Write,
    /// Gives a file its name.
    Rename,
    /// Removes a file.
    Remove,
}

/// Effect of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The operation does nothing and returns an error.
    Fail,
    /// Half of the bytes are written, then there is an error.
    ShortWrite,
    /// The process dies in the operation: half of the bytes may be written, temporary files stay, and no later operation happens.
    Crash,
    /// The watched folder is moved beside itself ([`moved`]), then the operation is tried.
    Move,
}

/// Folder to which [`Kind::Move`] moves a folder.
pub fn moved(folder: &Path) -> PathBuf {
    folder.with_extension("moved")
}

/// A fault at the n-th operation under a folder, counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// Effect.
    pub kind: Kind,
    /// Number of the operation.
    pub at: usize,
}

#[derive(Debug)]
struct Watched {
    folder: PathBuf,
    fault: Option<Fault>,
    operations: Vec<Operation>,
    is_dead: bool,
}

static WATCHED: Mutex<Vec<Watched>> = Mutex::new(Vec::new());

fn watched() -> MutexGuard<'static, Vec<Watched>> {
    WATCHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Counts the operations under a folder and lets a fault happen among them, until it is dropped.
#[derive(Debug)]
pub struct Watch(PathBuf);

impl Watch {
    /// Begins to watch a folder.
    pub fn begin(folder: &Path, fault: Option<Fault>) -> Self {
        let folder = folder.to_owned();
        watched().push(Watched { folder: folder.clone(), fault, operations: Vec::new(), is_dead: false });
        Self(folder)
    }

    /// The operations so far.
    pub fn operations(&self) -> Vec<Operation> {
        watched().iter().find(|w| w.folder == self.0).map(|w| w.operations.clone()).unwrap_or_default()
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        watched().retain(|w| w.folder != self.0);
    }
}

/// Counts an operation; the error is that of a fault.
pub(crate) fn before(path: &Path, operation: Operation) -> io::Result<()> {
    let mut all = watched();
    let Some(watched) = all.iter_mut().find(|w| path.starts_with(&w.folder)) else { return Ok(()) };
    if watched.is_dead {
        return Err(io::Error::other("the process is dead"));
    }
    let number = watched.operations.len();
    watched.operations.push(operation);
    match watched.fault {
        Some(fault) if fault.at == number && fault.kind == Kind::Move => {
            std::fs::rename(&watched.folder, moved(&watched.folder))
        }
        Some(fault) if fault.at == number => {
            watched.is_dead = fault.kind == Kind::Crash;
            Err(io::Error::other(format!("injected fault: {fault:?} ({operation:?})")))
        }
        _ => Ok(()),
    }
}

/// True if a folder that a path is in is watched.
pub(crate) fn is_watched(path: &Path) -> bool {
    watched().iter().any(|w| path.starts_with(&w.folder))
}

/// Leaves a file as a fault does: half written, and in its place if the process is dead.
pub(crate) fn leave_half(file: &mut NamedTempFile, bytes: &[u8]) {
    let (writes, dies) = watched()
        .iter()
        .find(|w| file.path().starts_with(&w.folder))
        .map_or((false, false), |w| (w.fault.is_some_and(|f| f.kind != Kind::Fail), w.is_dead));
    if writes {
        // The fault is reported by the caller.
        let _ = file.write_all(&bytes[..bytes.len() / 2]);
    }
    file.disable_cleanup(dies);
}
