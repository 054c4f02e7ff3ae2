//! Simulates a recorded episode again: the world under the recorded commands, and the controller beside it.
//!
//! The world is built from the recording's key and driven by its commands alone; the messages of this run are compared with the
//! recording one by one. The controller gets the observations of this world and computes its own commands; these move
//! nothing and are compared with the recorded ones.

mod comparison;
mod playback;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{self, Read};
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use orchard_tasks::harvest::{WorldFactory, run_observed_episode};
use orchard_tasks::protocol::Protocol;
use orchard_world::World;
use sha2::{Digest, Sha256};

use crate::channel::{Channel, Origin};
use crate::clock::nanoseconds;
use crate::config::RecordingConfig;
use crate::file::{FileSink, record_bytes};
use crate::read::{Recording, RecordingError};
use crate::recorder::Recorder;

use comparison::{Comparison, Shared};
pub use comparison::{Difference, Differs, Tally};
use playback::Playback;

/// Result of a replay.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Replayed {
    /// Frames that were simulated, settling not counted.
    pub frames: u32,
    /// Number of messages that agreed and that differed, by channel.
    pub tallies: BTreeMap<Channel, Tally>,
    /// The first difference in the world's messages, and in the controller's.
    pub differences: BTreeMap<Origin, Difference>,
    /// True if the episode's record equals the attached one.
    pub record_agrees: bool,
    /// True if the file, written again, has the same bytes.
    pub file_agrees: bool,
}

impl Replayed {
    /// True if everything agrees.
    pub fn agrees(&self) -> bool {
        self.differences.is_empty() && self.record_agrees && self.file_agrees
    }
}

/// A replay that did not come to an end.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recorded world cannot be built here.
    #[error("the recorded world cannot be built: {0}")]
    NoWorld(String),
    /// The stop flag was raised.
    #[error("interrupted")]
    Interrupted,
}

/// Replays a recording that [`Recording::check`] has passed. `frame` is the length of a frame \[s\]; `on_frame` is called after
/// every frame.
///
/// # Errors
/// The file does not read, the world cannot be built, or `stop` was raised.
pub fn replay<F: WorldFactory<World = World>>(
    recording: &Recording,
    factory: &F,
    protocol: &Protocol,
    frame: f64,
    config: &RecordingConfig,
    stop: &AtomicBool,
    on_frame: &mut dyn FnMut(),
) -> Result<Replayed, ReplayError> {
    let key = &recording.header().key;
    let (mut world, controller) = factory.build(key).map_err(ReplayError::NoWorld)?;
    let comparison = Rc::new(RefCell::new(Comparison::new(recording.messages()?)));
    let again =
        FileSink::begin(Hashing(Sha256::new()), recording.header()).map_err(|e| io_error(recording, e))?;
    let sink = (Shared(comparison.clone()), again);
    let mut recorder = Recorder::begin(sink, config.clone(), frame, &world);
    let mut playback = Playback::new(controller, comparison.clone());
    let record = run_observed_episode(
        key.clone(),
        &mut world,
        &mut playback,
        protocol,
        frame,
        stop,
        on_frame,
        &mut recorder,
    );
    let record = record.ok_or(ReplayError::Interrupted)?;
    let (_, again) = recorder.end(&world);
    let again = again.end(&record, nanoseconds(record.duration_s)).map_err(|e| io_error(recording, e))?;
    let file_agrees = again.0.finalize() == file_hash(recording)?;
    let found = comparison.borrow_mut().finish()?;
    Ok(Replayed {
        frames: record.frames,
        tallies: found.0,
        differences: found.1,
        record_agrees: record_bytes(&record) == recording.record(),
        file_agrees,
    })
}

fn io_error(recording: &Recording, source: io::Error) -> RecordingError {
    RecordingError::Io { path: recording.path().to_owned(), source: source.into() }
}

fn file_hash(recording: &Recording) -> Result<sha2::digest::Output<Sha256>, RecordingError> {
    let failed = |source| RecordingError::Io { path: recording.path().to_owned(), source };
    let (file, length) = orchard_input::open(recording.path(), orchard_input::RECORDING).map_err(failed)?;
    let mut hashing = Hashing(Sha256::new());
    // Another program may make the file longer meanwhile: one byte more is another file.
    io::copy(&mut file.take(length + 1), &mut hashing).map_err(|e| io_error(recording, e))?;
    Ok(hashing.0.finalize())
}

/// Hashes the bytes that are written, and keeps none.
struct Hashing(Sha256);

impl io::Write for Hashing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
