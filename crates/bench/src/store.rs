//! Result files: whole or not there.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::Serialize;

use crate::episode::{EpisodeKey, EpisodeRecord};

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

/// What was found where an episode's file belongs.
#[derive(Debug)]
pub enum Stored {
    /// No file.
    Missing,
    /// The whole record of this very episode.
    Whole(Box<EpisodeRecord>),
    /// A whole record of another config, code version or horizon.
    Other,
    /// Not a record as this code writes it.
    Damaged,
}

impl Store {
    /// Opens a result folder and makes it if needed.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn open(root: &Path) -> Result<Self, StoreError> {
        let store = Self { root: root.to_owned() };
        let episodes = store.root.join("episodes");
        fs::create_dir_all(&episodes).map_err(|e| error(&episodes, e))?;
        Ok(store)
    }

    /// Name of an episode's file under the folder.
    pub fn episode_name(key: &EpisodeKey) -> String {
        format!("episodes/{}-{}-{:03}.json", key.condition, key.seed, key.world)
    }

    /// Looks for a stored episode.
    pub fn stored(&self, key: &EpisodeKey) -> Stored {
        let Ok(bytes) = fs::read(self.root.join(Self::episode_name(key))) else {
            return Stored::Missing;
        };
        match serde_json::from_slice::<EpisodeRecord>(&bytes) {
            // Whatever was changed by hand and still reads would not be written like this.
            Ok(record) if encode(&record).ok().as_ref() != Some(&bytes) => Stored::Damaged,
            Ok(record) if record.key == *key => Stored::Whole(Box::new(record)),
            Ok(_) => Stored::Other,
            Err(_) => Stored::Damaged,
        }
    }

    /// Writes an episode.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_episode(&self, record: &EpisodeRecord) -> Result<(), StoreError> {
        self.write(&Self::episode_name(&record.key), record)
    }

    /// Writes a JSON file under the folder: to a temporary file first, which then takes the name.
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

    /// Episode files that are not among `names`, sorted.
    pub fn strangers(&self, names: &[String]) -> Vec<String> {
        let Ok(entries) = fs::read_dir(self.root.join("episodes")) else { return Vec::new() };
        let mut strangers: Vec<String> = entries
            .flatten()
            .map(|entry| format!("episodes/{}", entry.file_name().to_string_lossy()))
            .filter(|name| name.ends_with(".json") && !names.contains(name))
            .collect();
        strangers.sort();
        strangers
    }
}

/// Writes a JSON file whole: indented, with a final newline.
///
/// # Errors
/// The file cannot be written.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), StoreError> {
    encode(value).and_then(|bytes| write_file(path, &bytes)).map_err(|e| error(path, e))
}

/// Writes a file whole or not at all.
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
    let mut builder = tempfile::Builder::new();
    builder.prefix(".writing-");
    // Results are for everyone that the umask lets read; temporary files are private by default.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

fn encode(value: &impl Serialize) -> io::Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}

fn error(path: &Path, source: io::Error) -> StoreError {
    StoreError { path: path.display().to_string(), source }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::FruitState;
    use crate::fake::record;

    #[test]
    fn stored_episodes_are_told_apart() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let record = record(&[(FruitState::OnTree, true)]);
        assert!(matches!(store.stored(&record.key), Stored::Missing));
        store.write_episode(&record).unwrap();
        match store.stored(&record.key) {
            Stored::Whole(read) => assert_eq!(*read, record),
            other => panic!("{other:?}"),
        }
        let other = EpisodeKey { config_hash: "other".into(), ..record.key.clone() };
        assert!(matches!(store.stored(&other), Stored::Other));

        let path = folder.path().join(Store::episode_name(&record.key));
        let text = fs::read_to_string(&path).unwrap();
        for damaged in [&text[..text.len() / 2], &text.replace("\"frames\": 0", "\"frames\":  0"), ""] {
            fs::write(&path, damaged).unwrap();
            assert!(matches!(store.stored(&record.key), Stored::Damaged), "{damaged}");
        }
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
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().flatten().map(|e| e.file_name()).collect();
        assert_eq!(left, ["episodes"]);
        assert!(store.write("nowhere/x.json", &0).unwrap_err().to_string().contains("nowhere/x.json"));
    }
}
