//! The command log of an episode: what moved the robot, frame by frame, and what the controller logged.
//!
//! The world under these commands gives the episode again, and with the controller's log its record, byte by byte. So a result can be checked
//! where its controller cannot be run. A log is a file beside the record: [postcard](https://postcard.jamesmunns.com/wire-format), which
//! keeps every bit of a number, compressed by gzip.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use orchard_bench::record::Record;
use orchard_bench::store::{StoreError, make_folder, write_bytes};
use orchard_robot::io::{Command, Observation};
use orchard_world::WorldEvent;
use serde::{Deserialize, Serialize};

use crate::harvest::episode::{EpisodeKey, EpisodeRecord};
use crate::harvest::interface::{BenchController, ControllerEvent};
use crate::harvest::observe::{FrameInput, Observer, ObserverFactory};
use crate::harvest::run::WorldFactory;

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
    commands: Vec<Command>,
    /// Events that the controller logged, each with its frame, in order.
    events: Vec<(u32, ControllerEvent)>,
}

/// A command log that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {problem}")]
pub struct CommandLogError {
    path: String,
    problem: String,
}

/// Returns the path of an episode's log under the result folder.
pub fn path_of(key: &EpisodeKey) -> String {
    let record = EpisodeRecord::file(key);
    format!("{FOLDER}/{}.postcard.gz", record.strip_suffix(".json").unwrap_or(&record))
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
            let (file, _) = orchard_input::open(&path, orchard_input::RESULT).map_err(|e| e.to_string())?;
            let mut bytes = Vec::new();
            let size = GzDecoder::new(file).take(LARGEST + 1).read_to_end(&mut bytes);
            if size.map_err(|e| e.to_string())? as u64 > LARGEST {
                return Err(format!("the log is larger than {LARGEST} bytes"));
            }
            let log: Self = postcard::from_bytes(&bytes).map_err(|e| format!("not a command log: {e}"))?;
            if log.key == json(key) { Ok(log) } else { Err("the log is of another episode".to_owned()) }
        };
        read().map_err(|problem| CommandLogError { path: path.display().to_string(), problem })
    }

    /// Returns the bytes of the file.
    ///
    /// # Errors
    /// The log does not encode; memory does not fail, so this does not happen.
    pub fn to_bytes(&self) -> io::Result<Vec<u8>> {
        let plain = postcard::to_stdvec(self).map_err(io::Error::other)?;
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&plain)?;
        encoder.finish()
    }

    fn push(&mut self, command: &Command, events: &[ControllerEvent]) {
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

    /// Copies the logs of episodes from the first of some result folders that holds each whole; returns the number of those that none holds.
    ///
    /// # Errors
    /// Two of the folders hold different logs of an episode, or a file cannot be written.
    pub fn merge<'a>(
        &self,
        keys: impl Iterator<Item = &'a EpisodeKey>,
        from: &[&Path],
    ) -> Result<usize, StoreError> {
        let mut missing = 0;
        for key in keys {
            let holds = |root: &&Path| Some((root.join(path_of(key)), CommandLog::read(root, key).ok()?));
            let copies: Vec<(PathBuf, CommandLog)> = from.iter().filter_map(holds).collect();
            let Some(((first, log), others)) = copies.split_first() else {
                missing += 1;
                continue;
            };
            // Bytes, because a command may hold numbers that are not equal to themselves.
            let bytes = |log: &CommandLog, path: &Path| log.to_bytes().map_err(|e| StoreError::new(path, e));
            for (path, other) in others {
                if bytes(other, path)? != bytes(log, first)? {
                    let line = format!("differs from {}: delete the wrong one", first.display());
                    return Err(StoreError::new(path, io::Error::other(line)));
                }
            }
            self.write(key, log)?;
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

    fn is_kept(&self, key: &EpisodeKey) -> bool {
        CommandLog::read(&self.root, key).is_ok()
    }

    fn begin(&self, key: &EpisodeKey, _: &W) -> CommandLog {
        CommandLog::new(key)
    }

    fn end(&self, log: CommandLog, _: &W, record: &EpisodeRecord) -> Result<(), StoreError> {
        self.write(&record.key, &log)
    }
}

/// A controller that plays back a log.
pub struct Playback {
    log: CommandLog,
    frame: usize,
    next_event: usize,
}

impl Playback {
    /// Plays a log from its first frame. Beyond its last frame the robot is told to keep still, so that a log that is too short gives
    /// another episode than the recorded one.
    pub fn new(log: CommandLog) -> Self {
        Self { log, frame: 0, next_event: 0 }
    }
}

impl BenchController for Playback {
    fn act(&mut self, observation: &Observation) -> Command {
        let command = self.log.commands.get(self.frame).copied();
        self.frame += 1;
        command.unwrap_or_else(|| Command::still(observation))
    }

    fn drain_log(&mut self) -> Vec<ControllerEvent> {
        let rest = self.log.events.get(self.next_event..).unwrap_or_default();
        let of_frame = |(frame, _): &&(u32, ControllerEvent)| (*frame as usize) < self.frame;
        let events: Vec<ControllerEvent> =
            rest.iter().take_while(of_frame).map(|(_, event)| event.clone()).collect();
        self.next_event += events.len();
        events
    }
}

/// Worlds with controllers that play the command logs of a result folder back.
pub struct Replays<'a, F> {
    factory: &'a F,
    root: &'a Path,
}

impl<'a, F> Replays<'a, F> {
    /// Plays the logs under a result folder in the worlds of a factory.
    pub fn new(factory: &'a F, root: &'a Path) -> Self {
        Self { factory, root }
    }
}

impl<F: WorldFactory> WorldFactory for Replays<'_, F> {
    type World = F::World;
    type Controller = Playback;

    fn build(&self, key: &EpisodeKey) -> Result<(F::World, Playback), String> {
        let (world, _) = self.factory.build(key)?;
        let log = CommandLog::read(self.root, key).map_err(|e| e.to_string())?;
        Ok((world, Playback::new(log)))
    }
}

#[cfg(test)]
mod tests {
    use orchard_robot::ARM_DOF;

    use super::*;
    use crate::fake::key;

    fn log() -> CommandLog {
        let mut log = CommandLog::new(&key());
        let command = Command {
            arm_q: [0.1, -0.0, f64::NAN, f64::INFINITY, 1e-300, 2.0, -3.5],
            arm_v: [1.0 / 3.0; ARM_DOF],
            base_velocity: [0.1 + 0.2, f64::NEG_INFINITY, 0.0],
            finger_q: 0.04,
            finger_force: 20.0,
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
        assert!(!ObserverFactory::<()>::is_kept(&logs, &key()));
    }

    #[test]
    fn logs_that_differ_are_not_merged() {
        let folders = [0, 1, 2].map(|_| tempfile::tempdir().unwrap());
        let from = [folders[0].path(), folders[1].path()];
        let into = CommandLogs::new(folders[2].path());
        let keys = [key()];
        assert_eq!(into.merge(keys.iter(), &from).unwrap(), 1);
        for root in from {
            CommandLogs::new(root).write(&key(), &log()).unwrap();
        }
        assert_eq!(into.merge(keys.iter(), &from).unwrap(), 0);
        let mut other = log();
        other.commands.pop();
        CommandLogs::new(from[1]).write(&key(), &other).unwrap();
        let e = into.merge(keys.iter(), &from).unwrap_err().to_string();
        assert!(from.iter().all(|root| e.contains(&root.display().to_string())), "{e}");
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
