//! The command log of an episode: what moved the robot, frame by frame, and what the controller logged.
//!
//! The world under these commands gives the episode again, and with the controller's log its record, byte by byte. So a result can be checked
//! where its controller cannot be run. A log is a file beside the record: [postcard](https://postcard.jamesmunns.com/wire-format), which
//! keeps every bit of a number, compressed by gzip. The record holds the SHA-256 of the log before compression.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use orchard_bench::digest::sha256;
use orchard_bench::record::Record;
use orchard_bench::store::{StoreError, make_folder, write_bytes};
use orchard_robot::io::Command;
use orchard_world::WorldEvent;
use serde::{Deserialize, Serialize};

use crate::harvest::episode::{EpisodeKey, EpisodeRecord};
use crate::harvest::interface::ControllerEvent;
use crate::harvest::observe::{FrameInput, Observer, ObserverFactory};

/// Folder of the command logs under a result folder.
pub const FOLDER: &str = "commands";

/// Largest log that is read \[bytes, uncompressed\], our own choice: an hour at 60 frames a second with room for events.
const LARGEST: u64 = 1 << 26;

/// Commands of an episode and the controller's log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CommandLog {
    /// Key of the episode, as JSON.
    key: String,
    /// Commands, one a frame; the settling after the end has none of its own.
    pub(crate) commands: Vec<Command>,
    /// Events that the controller logged, each with its frame, in order.
    pub(crate) events: Vec<(u32, ControllerEvent)>,
}

/// A command log that cannot be read, or that is not the one of its record.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {problem}")]
pub struct CommandLogError {
    path: String,
    problem: String,
}

impl CommandLogError {
    fn new(path: &Path, problem: String) -> Self {
        Self { path: path.display().to_string(), problem }
    }
}

/// Logs that cannot be merged.
#[derive(Debug, thiserror::Error)]
pub enum MergeLogsError {
    /// A log that cannot be read, or is another one than that of its record.
    #[error(transparent)]
    Log(#[from] CommandLogError),
    /// A file cannot be written.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Returns the path of an episode's log under the result folder.
pub fn path_of(key: &EpisodeKey) -> String {
    let record = EpisodeRecord::file(key);
    format!("{FOLDER}/{}.postcard.gz", record.strip_suffix(".json").unwrap_or(&record))
}

/// Checks that the log under a result folder is the one of a record, by its SHA-256; false if there is no log.
///
/// # Errors
/// The file cannot be read, or is another log.
pub fn check(root: &Path, record: &EpisodeRecord) -> Result<bool, CommandLogError> {
    let path = root.join(path_of(&record.key));
    if !path.exists() {
        return Ok(false);
    }
    let other = || "does not match the SHA-256 in its record: it is damaged or was edited".to_owned();
    let check = || -> Result<bool, String> {
        let found = sha256(&plain(&path)?);
        if record.commands_sha256.as_ref() == Some(&found) { Ok(true) } else { Err(other()) }
    };
    check().map_err(|problem| CommandLogError::new(&path, problem))
}

/// A log as it was before compression.
fn plain(path: &Path) -> Result<Vec<u8>, String> {
    let (file, _) = orchard_input::open(path, orchard_input::RESULT).map_err(|e| e.to_string())?;
    let mut bytes = Vec::new();
    let size = GzDecoder::new(file).take(LARGEST + 1).read_to_end(&mut bytes);
    if size.map_err(|e| e.to_string())? as u64 > LARGEST {
        return Err(format!("the log is larger than {LARGEST} bytes"));
    }
    Ok(bytes)
}

impl CommandLog {
    /// An empty log at the start of an episode.
    pub fn new(key: &EpisodeKey) -> Self {
        Self { key: json(key), commands: Vec::new(), events: Vec::new() }
    }

    /// Reads the log of an episode under a result folder.
    ///
    /// # Errors
    /// There is no such file, it is damaged, or it is of another episode.
    pub fn read(root: &Path, key: &EpisodeKey) -> Result<Self, CommandLogError> {
        let path = root.join(path_of(key));
        let read = || -> Result<Self, String> {
            let log: Self =
                postcard::from_bytes(&plain(&path)?).map_err(|e| format!("not a command log: {e}"))?;
            if log.key == json(key) { Ok(log) } else { Err("the log is of another episode".to_owned()) }
        };
        read().map_err(|problem| CommandLogError::new(&path, problem))
    }

    /// SHA-256 of the log before compression, hexadecimal, as in [`EpisodeRecord::commands_sha256`].
    pub fn sha256(&self) -> String {
        sha256(&self.encoded())
    }

    fn encoded(&self) -> Vec<u8> {
        postcard::to_stdvec(self).unwrap_or_else(|e| unreachable!("numbers and text encode: {e}"))
    }

    /// Returns the bytes of the file.
    ///
    /// # Errors
    /// The log does not compress; memory does not fail, so this does not happen.
    pub fn to_bytes(&self) -> io::Result<Vec<u8>> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&self.encoded())?;
        encoder.finish()
    }

    /// Adds a frame.
    pub fn push(&mut self, command: &Command, events: &[ControllerEvent]) {
        let frame = self.commands.len() as u32;
        self.events.extend(events.iter().map(|event| (frame, event.clone())));
        self.commands.push(*command);
    }
}

/// Key as text: postcard cannot hold its flattened names.
fn json(key: &EpisodeKey) -> String {
    serde_json::to_string(key).unwrap_or_else(|e| unreachable!("names and numbers are JSON: {e}"))
}

impl<W> Observer<W> for CommandLog {
    fn before_step(&mut self, _: &W, frame: &FrameInput<'_>) {
        if frame.observation.is_some() {
            self.push(frame.command, frame.controller_events);
        }
    }

    fn after_step(&mut self, _: &W, _: &[WorldEvent]) {}
}

/// Writes a command log for every episode of a run.
#[derive(Debug, Clone)]
pub struct CommandLogs {
    root: PathBuf,
}

impl CommandLogs {
    /// Logs under a result folder.
    pub fn new(root: &Path) -> Self {
        Self { root: root.to_owned() }
    }

    /// Returns the folder of the logs.
    pub fn folder(&self) -> PathBuf {
        self.root.join(FOLDER)
    }

    /// Copies the logs of episodes from the first of some result folders that has each; returns the number of those that none has.
    ///
    /// # Errors
    /// One of the folders has a log that is not the one of the record, or a file cannot be written.
    pub fn merge(&self, records: &[EpisodeRecord], from: &[&Path]) -> Result<usize, MergeLogsError> {
        let mut missing = 0;
        // A world that could not be built has no log.
        for record in records.iter().filter(|record| record.commands_sha256.is_some()) {
            let mut first = None;
            for root in from {
                if check(root, record)? {
                    first = first.or(Some(root));
                }
            }
            match first {
                Some(root) => self.write(&record.key, &CommandLog::read(root, &record.key)?)?,
                None => missing += 1,
            }
        }
        Ok(missing)
    }

    fn write(&self, key: &EpisodeKey, log: &CommandLog) -> Result<(), StoreError> {
        let path = self.root.join(path_of(key));
        make_folder(&self.folder())?;
        write_bytes(&path, &log.to_bytes().map_err(|e| StoreError::new(&path, e))?)
    }

    /// Returns the number of logs and the size of all of them \[bytes\].
    pub fn size(&self) -> (usize, u64) {
        let files = std::fs::read_dir(self.folder()).into_iter().flatten().flatten();
        let sizes: Vec<u64> = files.filter_map(|file| file.metadata().ok()).map(|data| data.len()).collect();
        (sizes.len(), sizes.iter().sum())
    }
}

impl<W> ObserverFactory<W> for CommandLogs {
    type Observer = CommandLog;

    fn is_kept(&self, record: &EpisodeRecord) -> bool {
        check(&self.root, record).unwrap_or(false)
    }

    fn begin(&self, key: &EpisodeKey, _: &W) -> CommandLog {
        CommandLog::new(key)
    }

    fn end(&self, log: CommandLog, _: &W, record: &EpisodeRecord) -> Result<(), StoreError> {
        self.write(&record.key, &log)
    }
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::fake::key;
    use crate::harvest::harness::never_started;

    fn log() -> CommandLog {
        let mut log = CommandLog::new(&key());
        let command = Command {
            arm_q: [0.1, -0.0, f64::NAN, f64::INFINITY, 1e-300, 2.0, -3.5].into(),
            arm_v: [1.0 / 3.0; 7].into(),
            base_velocity: [0.1 + 0.2, f64::NEG_INFINITY, 0.0],
            finger_q: 0.04,
            finger_force: 20.0,
            vacuum: 0.5,
        };
        log.push(&command, &[ControllerEvent::StateChanged { state: "reach".into() }]);
        log.push(&Command { finger_q: 0.0, ..command }, &[]);
        let events = [ControllerEvent::Grasped { width: 0.07 }, ControllerEvent::Yielded { force: 3.0 }];
        log.push(&command, &events);
        log
    }

    #[test]
    fn a_log_comes_back_with_every_bit() {
        let folder = tempfile::tempdir().unwrap();
        let logs = CommandLogs::new(folder.path());
        let bits = |log: &CommandLog| postcard::to_stdvec(log).unwrap();
        let path = folder.path().join(path_of(&key()));
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, log().to_bytes().unwrap()).unwrap();
        assert_eq!(bits(&CommandLog::read(folder.path(), &key()).unwrap()), bits(&log()));
        assert_eq!(logs.size(), (1, std::fs::metadata(&path).unwrap().len()));

        let other = EpisodeKey { config_hash: "other".into(), ..key() };
        let e = CommandLog::read(folder.path(), &other).unwrap_err().to_string();
        assert!(e.ends_with("the log is of another episode"), "{e}");
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert!(CommandLog::read(folder.path(), &key()).is_err());
        assert!(!ObserverFactory::<()>::is_kept(&logs, &record()));
    }

    /// The record of the episode of [`log`].
    fn record() -> EpisodeRecord {
        let commands_sha256 = Some(log().sha256());
        EpisodeRecord { commands_sha256, ..never_started(key(), String::new()) }
    }

    #[test]
    fn a_log_that_is_not_the_one_of_its_record_is_found() {
        let folders = [0, 1, 2].map(|_| tempfile::tempdir().unwrap());
        let from = [folders[0].path(), folders[1].path()];
        let into = CommandLogs::new(folders[2].path());
        let records = [record()];
        assert_eq!(into.merge(&records, &from).unwrap(), 1);
        assert!(!check(from[0], &record()).unwrap());
        for root in from {
            CommandLogs::new(root).write(&key(), &log()).unwrap();
            assert!(check(root, &record()).unwrap());
        }
        assert_eq!(into.merge(&records, &from).unwrap(), 0);
        let written = |root: &Path| std::fs::read(root.join(path_of(&key()))).unwrap();
        assert_eq!(written(folders[2].path()), written(from[0]));
        let kept = |root| ObserverFactory::<()>::is_kept(&CommandLogs::new(root), &record());
        assert!(kept(from[1]));
        // One bit of one command.
        let mut other = log();
        other.commands[1].arm_q[0] = f64::from_bits(other.commands[1].arm_q[0].to_bits() ^ 1);
        CommandLogs::new(from[1]).write(&key(), &other).unwrap();
        let e = into.merge(&records, &from).unwrap_err().to_string();
        assert!(
            e.contains(&from[1].display().to_string()) && e.contains("does not match the SHA-256"),
            "{e}"
        );
        assert!(!kept(from[1]));
    }

    #[test]
    fn a_log_that_grows_without_end_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(path_of(&key()));
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        io::copy(&mut io::repeat(0).take(LARGEST + 2), &mut encoder).unwrap();
        std::fs::write(&path, encoder.finish().unwrap()).unwrap();
        let e = CommandLog::read(folder.path(), &key()).unwrap_err().to_string();
        assert!(e.contains("larger than"), "{e}");
    }
}
