//! Result files, each written atomically: it is complete or absent.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::Serialize;

use crate::record::Record;

/// A result folder.
#[derive(Debug, Clone)]
pub struct Store {
    root: PathBuf,
}

/// A result file that could not be written or removed.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {source}")]
pub struct StoreError {
    path: String,
    source: io::Error,
}

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

/// Prefix of the names of half-written files.
const HALF_WRITTEN: &str = ".writing-";

impl StoreError {
    /// True if the disk is full.
    pub fn is_full(&self) -> bool {
        use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        matches!(self.source.kind(), StorageFull | QuotaExceeded | FileTooLarge)
    }

    /// Error of a file.
    pub fn new(path: &Path, source: io::Error) -> Self {
        Self { path: path.display().to_string(), source }
    }
}

/// State of a record's file.
#[derive(Debug)]
pub enum Stored<R> {
    /// No file.
    Missing,
    /// The complete record of exactly this key.
    Whole(Box<R>),
    /// A complete record of another key: for example, another config or code version.
    Other,
    /// A file that this code would not have written.
    Damaged,
}

impl Store {
    /// Opens a result folder and creates it if needed.
    ///
    /// # Errors
    /// The folder cannot be created.
    pub fn open(root: &Path) -> Result<Self, StoreError> {
        fs::create_dir_all(root).map_err(|e| error(root, e))?;
        Ok(Self { root: root.to_owned() })
    }

    /// Locks the folder for this process until the lock is dropped or the process ends in any way. Incomplete files of earlier
    /// processes are removed.
    ///
    /// # Errors
    /// Another process has locked the folder, or it is not writable.
    pub fn lock(&self) -> Result<Lock, LockError> {
        let path = self.root.join(".lock");
        let write = |e| LockError::Store(error(&path, e));
        let file = fs::File::options().create(true).truncate(false).write(true).open(&path).map_err(write)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(fs::TryLockError::WouldBlock) => {
                return Err(LockError::Busy(self.root.display().to_string()));
            }
            Err(fs::TryLockError::Error(e)) => return Err(write(e)),
        }
        self.remove_half_written().map_err(LockError::Store)?;
        Ok(Lock { _file: file })
    }

    fn remove_half_written(&self) -> Result<(), StoreError> {
        let folders = fs::read_dir(&self.root).map_err(|e| error(&self.root, e))?;
        let folders = folders.flatten().map(|entry| entry.path()).filter(|path| path.is_dir());
        for folder in folders.chain([self.root.clone()]) {
            for entry in fs::read_dir(&folder).map_err(|e| error(&folder, e))?.flatten() {
                if entry.file_name().to_string_lossy().starts_with(HALF_WRITTEN) {
                    fs::remove_file(entry.path()).map_err(|e| error(&entry.path(), e))?;
                }
            }
        }
        Ok(())
    }

    /// Looks for a stored record.
    pub fn stored<R: Record>(&self, key: &R::Key) -> Stored<R> {
        let Ok(bytes) = orchard_input::bytes(&self.root.join(R::path(key)), orchard_input::RESULT) else {
            return Stored::Missing;
        };
        match serde_json::from_slice::<R>(&bytes) {
            // A record that was edited by hand and can still be read has other bytes than this code writes.
            Ok(record) if encode(&record).ok().as_ref() != Some(&bytes) => Stored::Damaged,
            Ok(record) if record.key() == key => Stored::Whole(Box::new(record)),
            Ok(_) => Stored::Other,
            Err(_) => Stored::Damaged,
        }
    }

    /// Writes a record, and creates its folder if needed.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_record<R: Record>(&self, record: &R) -> Result<(), StoreError> {
        let folder = self.root.join(R::FOLDER);
        fs::create_dir_all(&folder).map_err(|e| error(&folder, e))?;
        self.write(&R::path(record.key()), record)
    }

    /// Writes a JSON file under the folder: first a temporary file, which is then renamed.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, name: &str, value: &impl Serialize) -> Result<(), StoreError> {
        write_json(&self.root.join(name), value)
    }

    /// Removes a file under the folder, if there.
    ///
    /// # Errors
    /// The file is there and cannot be removed.
    pub fn remove(&self, name: &str) -> Result<(), StoreError> {
        let path = self.root.join(name);
        match fs::remove_file(&path) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => Err(error(&path, e)),
            _ => Ok(()),
        }
    }

    /// JSON files in a folder under this one, sorted, with the folder's name.
    pub fn files(&self, folder: &str) -> Vec<String> {
        let Ok(entries) = fs::read_dir(self.root.join(folder)) else { return Vec::new() };
        let mut files: Vec<String> = entries
            .flatten()
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .filter(|name| name.ends_with(".json"))
            .map(|name| format!("{folder}/{name}"))
            .collect();
        files.sort();
        files
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.root
    }
}

/// Writes a JSON file atomically: indented, with a final newline.
///
/// # Errors
/// The file cannot be written.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), StoreError> {
    encode(value).and_then(|bytes| write_file(path, &bytes)).map_err(|e| error(path, e))
}

/// Writes a file atomically: completely or not at all.
///
/// # Errors
/// The file cannot be written.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    write_file(path, bytes).map_err(|e| error(path, e))
}

fn write_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = temporary_in(folder)?;
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

/// A temporary file that is renamed later.
pub(crate) fn temporary_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(HALF_WRITTEN);
    // Results are readable as the umask allows; temporary files are private by default.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Returns the bytes of a JSON file: indented, with a final newline.
///
/// # Errors
/// The value cannot be written as JSON.
pub fn encode(value: &impl Serialize) -> io::Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}

fn error(path: &Path, source: io::Error) -> StoreError {
    StoreError::new(path, source)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::{Sum, SumKey, record};

    fn stored(store: &Store, key: &SumKey) -> Stored<Sum> {
        store.stored(key)
    }

    #[test]
    fn stored_records_are_told_apart() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let record = record(0);
        assert!(matches!(stored(&store, &record.key), Stored::Missing));
        store.write_record(&record).unwrap();
        match stored(&store, &record.key) {
            Stored::Whole(read) => assert_eq!(*read, record),
            other => panic!("{other:?}"),
        }
        let other = SumKey { config_hash: "other".into(), ..record.key.clone() };
        assert!(matches!(stored(&store, &other), Stored::Other));

        let path = folder.path().join(Sum::path(&record.key));
        let text = fs::read_to_string(&path).unwrap();
        for damaged in [&text[..text.len() / 2], &text.replace("\"sum\": 7", "\"sum\":  7"), ""] {
            fs::write(&path, damaged).unwrap();
            assert!(matches!(stored(&store, &record.key), Stored::Damaged), "{damaged}");
        }
    }

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
        let e = store.lock().unwrap_err();
        assert!(e.to_string().ends_with("wait until it ends, or choose another folder"), "{e}");
        drop(lock);
        store.lock().unwrap();
    }

    #[test]
    fn nothing_but_whole_files_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        store.write("summary.json", &[1, 2]).unwrap();
        store.write("summary.json", &[3]).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("summary.json")).unwrap(), "[\n  3\n]\n");
        store.remove("summary.json").unwrap();
        store.remove("summary.json").unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        assert!(store.write("nowhere/x.json", &0).unwrap_err().to_string().contains("nowhere/x.json"));
    }
}
