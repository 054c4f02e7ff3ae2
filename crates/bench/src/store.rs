//! Result files, each written atomically: it is complete or absent.
//!
//! A store holds its folder, and the folders under it that it writes into, open. If one of them is moved, removed or replaced
//! while a run writes, the next write returns an error: the parts of a result never end in two folders.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::{fs, io};

use serde::Serialize;

pub use crate::checksum::{Damage, checked, encode, encode_plain};
use crate::disk;
use crate::folder::HeldFolder;
use crate::record::Record;

/// A result folder.
#[derive(Debug, Clone)]
pub struct Store {
    root: PathBuf,
    held: Arc<Held>,
}

/// The folders that a store writes into.
#[derive(Debug)]
struct Held {
    root: HeldFolder,
    /// By name under the root.
    under: Mutex<BTreeMap<String, Arc<HeldFolder>>>,
}

/// A result file that could not be written or removed, or that is damaged.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {source}")]
pub struct StoreError {
    path: String,
    source: io::Error,
}

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

    /// The damage of a file that was read.
    pub fn damage(&self) -> Option<Damage> {
        self.source.get_ref()?.downcast_ref().copied()
    }
}

/// State of a record's file.
#[derive(Debug)]
pub enum Stored<R> {
    /// No file.
    Missing,
    /// The complete record of exactly this key, with a right checksum.
    Whole(Box<R>),
    /// A complete record of another key: for example, another config or code version.
    Other,
    /// A file without a right checksum, or that this code would not have written.
    Damaged,
}

impl Store {
    /// Opens a result folder and creates it if needed.
    ///
    /// # Errors
    /// The folder cannot be created or opened.
    pub fn open(root: &Path) -> Result<Self, StoreError> {
        let held = disk::create_folders(root).and_then(|()| HeldFolder::open(root));
        let held = held.map_err(|e| error(root, e))?;
        let held = Arc::new(Held { root: held, under: Mutex::default() });
        Ok(Self { root: root.to_owned(), held })
    }

    /// Looks for a stored record.
    pub fn stored<R: Record>(&self, key: &R::Key) -> Stored<R> {
        let Ok(bytes) = orchard_input::bytes(&self.root.join(R::path(key)), orchard_input::RESULT) else {
            return Stored::Missing;
        };
        let record = match checked(&bytes) {
            Ok(content) => serde_json::from_slice::<R>(&content),
            Err(Damage::WrongChecksum) => return Stored::Damaged,
            // Code before schema 6 wrote no checksums; its records have other keys.
            Err(Damage::NoChecksum) => serde_json::from_slice::<R>(&bytes),
        };
        match record {
            Ok(record) if record.key() != key => Stored::Other,
            // A record whose checksum was edited too, and that can still be parsed, has other bytes than this code writes.
            Ok(record) if encode(&record).ok().as_ref() == Some(&bytes) => Stored::Whole(Box::new(record)),
            _ => Stored::Damaged,
        }
    }

    /// Writes a record, and creates its folder if needed.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_record<R: Record>(&self, record: &R) -> Result<(), StoreError> {
        self.make_folder(R::FOLDER)?;
        self.write(&R::path(record.key()), record)
    }

    /// Checks that the folder is where it was when the store was opened.
    ///
    /// # Errors
    /// It was moved, removed or replaced.
    pub fn check(&self) -> Result<(), StoreError> {
        self.held.root.check().map_err(|e| error(&self.root, e))
    }

    /// Creates a folder directly under this one if needed. One that this store has used and that is gone is not created again.
    ///
    /// # Errors
    /// The folder cannot be created, or it was moved or removed.
    pub fn make_folder(&self, name: &str) -> Result<(), StoreError> {
        let path = self.root.join(name);
        let make = || {
            self.held.root.check()?;
            let created = if self.is_held(name) { Ok(()) } else { disk::create_folder(&path) };
            let checked = created.and_then(|()| self.check_folder(name));
            self.held.root.check()?;
            checked
        };
        make().map_err(|e| error(&path, e))
    }

    /// Writes a JSON file with its checksum under the folder: to a temporary file first, which then takes the name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, name: &str, value: &impl Serialize) -> Result<(), StoreError> {
        let bytes = encode(value).map_err(|e| error(&self.root.join(name), e))?;
        self.write_bytes(name, &bytes)
    }

    /// Writes a file under the folder, or under a folder in it, completely or not at all.
    ///
    /// # Errors
    /// The file cannot be written, or a folder was moved, removed or replaced since the first write into it.
    pub fn write_bytes(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        let path = self.root.join(name);
        let write = || {
            self.check_folder_of(name)?;
            let written = write_file(&path, bytes);
            // A folder that was moved since the check is the better reason for a failed write, and a write that went elsewhere fails.
            self.check_folder_of(name)?;
            written
        };
        write().map_err(|e| error(&path, e))
    }

    /// Reads a JSON file under the folder and checks its checksum; `None` if there is no such file. Returns its content without the
    /// checksum.
    ///
    /// # Errors
    /// The file cannot be read, or its checksum is wrong or missing.
    pub fn read(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError> {
        let path = self.root.join(name);
        match fs::read(&path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(error(&path, e)),
            Ok(bytes) => match checked(&bytes) {
                Ok(content) => Ok(Some(content)),
                Err(damage) => Err(error(&path, io::Error::new(io::ErrorKind::InvalidData, damage))),
            },
        }
    }

    /// Checks that files of a result are there, before the file is written that marks the result as complete.
    ///
    /// # Errors
    /// The first one that is not there.
    pub fn check_files(&self, names: impl IntoIterator<Item = impl AsRef<str>>) -> Result<(), StoreError> {
        for name in names {
            let path = self.root.join(name.as_ref());
            if !path.is_file() {
                let gone = "was removed during the run; run the same command again to continue";
                return Err(error(&path, io::Error::new(io::ErrorKind::NotFound, gone)));
            }
        }
        Ok(())
    }

    /// Removes a file under the folder, if there.
    ///
    /// # Errors
    /// The file is there and cannot be removed.
    pub fn remove(&self, name: &str) -> Result<(), StoreError> {
        let path = self.root.join(name);
        let remove = || {
            self.check_folder_of(name)?;
            let removed = disk::remove(&path);
            self.check_folder_of(name)?;
            removed
        };
        remove().map_err(|e| error(&path, e))
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

    fn is_held(&self, folder: &str) -> bool {
        self.held.under.lock().unwrap_or_else(PoisonError::into_inner).contains_key(folder)
    }

    /// Checks the folder that a file is in.
    fn check_folder_of(&self, name: &str) -> io::Result<()> {
        self.held.root.check()?;
        name.rsplit_once('/').map_or(Ok(()), |(folder, _)| self.check_folder(folder))
    }

    /// Checks a folder under this one; the first check holds it.
    fn check_folder(&self, folder: &str) -> io::Result<()> {
        let held = {
            let mut under = self.held.under.lock().unwrap_or_else(PoisonError::into_inner);
            match under.get(folder) {
                Some(held) => held.clone(),
                None => {
                    let held = Arc::new(HeldFolder::open(&self.root.join(folder))?);
                    under.insert(folder.to_owned(), held.clone());
                    held
                }
            }
        };
        held.check()
    }
}

/// Creates a folder in an existing one, if there is none.
///
/// # Errors
/// The folder cannot be created.
pub fn make_folder(path: &Path) -> Result<(), StoreError> {
    disk::create_folder(path).map_err(|e| error(path, e))
}

/// Writes a JSON file atomically, without a checksum: indented, with a final newline.
///
/// # Errors
/// The file cannot be written.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), StoreError> {
    encode_plain(value).and_then(|bytes| write_file(path, &bytes)).map_err(|e| error(path, e))
}

/// Writes a file completely or not at all.
///
/// # Errors
/// The file cannot be written.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    write_file(path, bytes).map_err(|e| error(path, e))
}

/// Removes half-written files of a path that earlier processes left. Other half-written files in the folder may belong to a process that
/// is at work.
///
/// # Errors
/// The folder cannot be read, or a file cannot be removed.
pub fn remove_half_written(path: &Path) -> Result<(), StoreError> {
    let remove = || {
        for entry in fs::read_dir(disk::folder_of(path))? {
            let entry = entry?;
            if entry.file_type()?.is_file() && disk::is_half_written_of(&entry.file_name(), path) {
                disk::remove(&entry.path())?;
            }
        }
        Ok(())
    };
    remove().map_err(|e| error(path, e))
}

fn write_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = disk::begin(path)?;
    disk::write(&mut file, bytes)?;
    disk::finish(file, path)
}

fn error(path: &Path, source: io::Error) -> StoreError {
    StoreError::new(path, source)
}

#[cfg(test)]
#[path = "store_tests.rs"]
mod tests;
