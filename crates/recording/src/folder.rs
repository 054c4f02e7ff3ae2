//! The recordings of a run: a file an episode, beside the records.

use std::path::{Path, PathBuf};

use orchard_bench::atomic_file::AtomicFile;
use orchard_bench::record::Record;
use orchard_bench::store::StoreError;
use orchard_scenario::{Scenario, StoredScenario};
use orchard_tasks::harvest::episode::{EpisodeKey, EpisodeRecord};
use orchard_tasks::harvest::observe::{FrameInput, Observer, ObserverFactory};
use orchard_world::World;
use orchard_world::WorldEvent;

use crate::clock::nanoseconds;
use crate::config::RecordingConfig;
use crate::file::{FileSink, Header, record_bytes};
use crate::read::Recording;
use crate::recorder::Recorder;

/// Folder of the recordings under a result folder.
pub const FOLDER: &str = "recordings";

/// Name of an episode's recording, under the result folder.
pub fn name_of(key: &EpisodeKey) -> String {
    let record = EpisodeRecord::file(key);
    format!("{FOLDER}/{}.mcap", record.strip_suffix(".json").unwrap_or(&record))
}

/// Records every episode of a run.
#[derive(Debug, Clone)]
pub struct Recordings {
    root: PathBuf,
    config: RecordingConfig,
    scenario: StoredScenario,
    frame: f64,
}

impl Recordings {
    /// Recordings of a scenario's episodes, under a result folder.
    pub fn new(root: &Path, config: RecordingConfig, scenario: &Scenario) -> Self {
        let frame = scenario.spec().sim.frame();
        Self { root: root.to_owned(), config, scenario: scenario.stored(), frame }
    }

    fn header(&self, key: &EpisodeKey) -> Header {
        Header::new(key, self.config.hash(), self.scenario.clone())
    }
}

/// A recorder into a file, or why there is none.
pub struct Episode {
    path: PathBuf,
    recorder: Result<Recorder<FileSink<AtomicFile>>, StoreError>,
}

impl Observer<World> for Episode {
    fn before_step(&mut self, world: &World, frame: &FrameInput<'_>) {
        if let Ok(recorder) = &mut self.recorder {
            recorder.before_step(world, frame);
        }
    }

    fn after_step(&mut self, world: &World, events: &[WorldEvent]) {
        if let Ok(recorder) = &mut self.recorder {
            recorder.after_step(world, events);
        }
    }
}

impl ObserverFactory<World> for Recordings {
    type Observer = Episode;

    fn is_kept(&self, record: &EpisodeRecord) -> bool {
        let recording = Recording::open(&self.root.join(name_of(&record.key)));
        let is_own = |recording: Recording| {
            *recording.header() == self.header(&record.key) && recording.record() == record_bytes(record)
        };
        recording.is_ok_and(is_own)
    }

    fn begin(&self, key: &EpisodeKey, world: &World) -> Episode {
        let path = self.root.join(name_of(key));
        let sink = AtomicFile::begin(&path)
            .and_then(|file| FileSink::begin(file, &self.header(key)).map_err(|e| StoreError::new(&path, e)));
        let recorder = sink.map(|sink| Recorder::begin(sink, self.config.clone(), self.frame, world));
        Episode { path, recorder }
    }

    fn end(&self, recording: Episode, world: &World, record: &EpisodeRecord) -> Result<(), StoreError> {
        let Episode { path, recorder } = recording;
        let end = nanoseconds(record.duration_s);
        let file = recorder?.end(world).end(record, end).map_err(|e| StoreError::new(&path, e))?;
        file.finish()
    }
}
