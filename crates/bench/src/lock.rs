//! Lock of a result folder: one process at a time writes into it.

use std::path::Path;
use std::{fs, io};

use crate::disk;
use crate::store::{Store, StoreError};

/// Name of the file under a folder that is locked. It stays there, empty.
pub const LOCK_FILE: &str = ".lock";

/// Lock of a result folder: no other process writes into it.
#[derive(Debug)]
pub struct Lock {
    _file: fs::File,
}

/// A result folder that cannot be locked.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another process has locked the folder.
    #[error("{0}: another run is using this folder; wait until it ends, or choose another folder")]
    Busy(String),
    /// The folder cannot be written to.
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl Store {
    /// Locks the folder for this process until the lock is dropped or the process ends in any way. Incomplete files of earlier
    /// processes are removed.
    ///
    /// # Errors
    /// Another process has locked the folder, or it is not writable.
    pub fn lock(&self) -> Result<Lock, LockError> {
        let path = self.path().join(LOCK_FILE);
        let write = |e| LockError::Store(StoreError::new(&path, e));
        let file = fs::File::options().create(true).truncate(false).write(true).open(&path).map_err(write)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(fs::TryLockError::WouldBlock) => {
                return Err(LockError::Busy(self.path().display().to_string()));
            }
            Err(fs::TryLockError::Error(e)) => return Err(write(e)),
        }
        remove_half_written(self.path())?;
        Ok(Lock { _file: file })
    }
}

/// Removes half-written files in a folder and in the folders directly under it. Links are not followed: what they lead to may
/// belong to another run.
fn remove_half_written(root: &Path) -> Result<(), StoreError> {
    let failed = |path: &Path, e: io::Error| StoreError::new(path, e);
    let mut folders = vec![root.to_owned()];
    for entry in fs::read_dir(root).map_err(|e| failed(root, e))? {
        let entry = entry.map_err(|e| failed(root, e))?;
        if entry.file_type().map_err(|e| failed(&entry.path(), e))?.is_dir() {
            folders.push(entry.path());
        }
    }
    for folder in folders {
        for entry in fs::read_dir(&folder).map_err(|e| failed(&folder, e))? {
            let entry = entry.map_err(|e| failed(&folder, e))?;
            let is_file = entry.file_type().map_err(|e| failed(&entry.path(), e))?.is_file();
            if is_file && disk::is_half_written(&entry.file_name()) {
                disk::remove(&entry.path()).map_err(|e| failed(&entry.path(), e))?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_one_run_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        fs::create_dir(folder.path().join("episodes")).unwrap();
        for left in [".writing-abc", "episodes/.writing-def"] {
            fs::write(folder.path().join(left), "{").unwrap();
        }
        let lock = store.lock().unwrap();
        assert_eq!(fs::read_dir(folder.path().join("episodes")).unwrap().count(), 0);
        assert!(!folder.path().join(".writing-abc").exists());
        let e = store.lock().unwrap_err();
        assert!(e.to_string().ends_with("wait until it ends, or choose another folder"), "{e}");
        drop(lock);
        store.lock().unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn half_written_files_behind_links_are_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (own, other) = (folder.path().join("own"), folder.path().join("other"));
        fs::create_dir(&other).unwrap();
        fs::write(other.join(".writing-abc"), "{").unwrap();
        let store = Store::open(&own).unwrap();
        std::os::unix::fs::symlink(&other, own.join("episodes")).unwrap();
        std::os::unix::fs::symlink(other.join(".writing-abc"), own.join(".writing-link")).unwrap();
        fs::create_dir(own.join(".writing-folder")).unwrap();
        store.lock().unwrap();
        assert!(other.join(".writing-abc").exists());
    }
}
