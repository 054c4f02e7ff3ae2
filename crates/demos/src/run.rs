//! Runs every episode of a plan, in parallel, into a folder.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use orchard_bench::PlanError;
use orchard_bench::digest::{FilesDigest, hex, sha256};
use orchard_bench::store::{Store, StoreError};
use orchard_bench::task::{Progress, RunError, Session, Task, TaskResult, run_task};
use orchard_env::{EnvError, TaskEnv};

use crate::episode::{self, Berths, COMMANDS, EpisodeError, STEPS, begin};
use crate::images::Form;
use crate::meta::Meta;
use crate::plan::Plan;
use crate::record::{DemoKey, DemoRecord, Demonstration, FileRecord};
use crate::summary::DemosSummary;
use crate::table::{Column, Table};
use crate::take::{Playback, Played, take_under};

/// A finished run.
pub type DemosResult = TaskResult<DemoRecord, DemosSummary>;

/// Runs a plan: writes `meta.json`, then the files and the record of each episode, `compute.json`, and the summary.
///
/// # Errors
/// The folder holds demonstrations of another plan, a file cannot be written, or `stop` was raised. Whole episodes are stored and will be
/// reused.
pub fn run(
    plan: &Plan,
    session: &Session<'_>,
    progress: &impl Progress<DemoRecord>,
) -> Result<DemosResult, RunError> {
    write_plan(plan, session.store)?;
    run_task(&Demos::new(plan, session.store), session, progress)
}

/// As [`run`], with the worlds in berths on a graphics device, where as many episodes advance together as there are lanes. The berths are those of the plan's share ([`Plan::share`]).
///
/// # Errors
/// As [`run`]. Once the device is lost ([`orchard_lockstep::Berths::lost`]) no episode ends any more, and those that remain count as interrupted.
#[cfg(feature = "gpu")]
pub fn run_in_berths(
    plan: &Plan,
    session: &Session<'_>,
    berths: &orchard_lockstep::Berths,
    progress: &impl Progress<DemoRecord>,
) -> Result<DemosResult, RunError> {
    write_plan(plan, session.store)?;
    let demos = Demos { berths: Some(berths), ..Demos::new(plan, session.store) };
    run_task(&demos, session, progress)
}

/// Checks that a folder has no other demonstrations, and writes a plan's `meta.json` and the folders of its files.
pub(crate) fn write_plan(plan: &Plan, store: &Store) -> Result<(), RunError> {
    store.check_plan::<DemoRecord>(&plan.keys())?;
    let images = plan.fields.iter().filter(|field| matches!(Form::of(field), Form::Depth | Form::Colour));
    for folder in [STEPS, COMMANDS].into_iter().chain(images.map(|field| field.key)) {
        store.make_folder(folder)?;
    }
    store.write(Meta::FILE, &Meta::of(plan))?;
    Ok(())
}

/// The episodes of a plan as a task of the benchmark's core.
pub struct Demos<'a> {
    plan: &'a Plan,
    store: &'a Store,
    drive: Option<(&'a DemoKey, &'a Played)>,
    berths: Option<&'a Berths>,
}

impl<'a> Demos<'a> {
    /// The episodes of a plan in a folder.
    pub fn new(plan: &'a Plan, store: &'a Store) -> Self {
        Self { plan, store, drive: None, berths: None }
    }

    /// Plays the episode of a key as it was driven.
    pub(crate) fn with_drive(self, key: &'a DemoKey, played: &'a Played) -> Self {
        Self { drive: Some((key, played)), ..self }
    }

    /// True if the device was lost: worlds stand still then.
    fn is_lost(&self) -> bool {
        #[cfg(feature = "gpu")]
        return self.berths.is_some_and(|berths| berths.lost().is_some());
        #[cfg(not(feature = "gpu"))]
        false
    }

    fn demonstrate(
        &self,
        key: &DemoKey,
        stop: &AtomicBool,
        on_step: &mut dyn FnMut(),
    ) -> Result<Option<Demonstration>, EpisodeError> {
        let mut env = begin(self.plan, key, self.berths)?;
        let (mut controller, via) = (env.controller(0)?, self.plan.via);
        let driven = self.drive.filter(|(of, _)| *of == key);
        let mut playback = driven.map(|(_, played)| Playback::new(via, played.clone(), true));
        let mut take = |env: &mut TaskEnv| match &mut playback {
            Some(playback) => playback.step(env),
            None => take_under(env, &mut *controller, via),
        };
        let mut sink = |path: &str, bytes: &[u8]| self.store.write_bytes(path, bytes);
        let episode = episode::run(self.plan, key, &mut env, &mut take, &mut sink, stop, on_step)?;
        let Some(episode) = episode.filter(|_| !self.is_lost()) else { return Ok(None) };
        let (record, tables) = episode.files(key)?;
        for (file, bytes) in [&record.steps, &record.commands].into_iter().zip(&tables) {
            self.store.write_bytes(&file.path, bytes)?;
        }
        Ok(Some(record))
    }
}

impl Task for Demos<'_> {
    type Record = DemoRecord;
    type Summary = DemosSummary;
    const NAME: &'static str = "demos";
    const SUMMARY: &'static str = "summary.json";

    fn check(&self) -> Result<(), PlanError> {
        // A plan is checked as it is made.
        Ok(())
    }

    fn keys(&self) -> Vec<DemoKey> {
        self.plan.keys()
    }

    fn compute(
        &self,
        key: &DemoKey,
        stop: &AtomicBool,
        on_step: &mut dyn FnMut(),
    ) -> Result<Option<DemoRecord>, StoreError> {
        let record = |never_began, demonstration| DemoRecord { key: key.clone(), never_began, demonstration };
        match self.demonstrate(key, stop, on_step) {
            Ok(None) => Ok(None),
            Ok(demonstration) => Ok(Some(record(None, demonstration))),
            Err(EpisodeError::Env(e @ (EnvError::World { .. } | EnvError::NoTarget { .. }))) => {
                Ok(Some(record(Some(e.to_string()), None)))
            }
            Err(EpisodeError::Store(e)) => Err(e),
            Err(e) => Err(StoreError::new(self.store.path(), std::io::Error::other(e.to_string()))),
        }
    }

    fn steps(&self, record: &DemoRecord) -> u64 {
        record.frames()
    }

    fn frame(&self) -> f64 {
        self.plan.frame
    }

    fn sum_up(&self, records: &[DemoRecord]) -> DemosSummary {
        DemosSummary::of(self.plan, records)
    }

    #[cfg(feature = "gpu")]
    fn at_once(&self, threads: usize) -> usize {
        self.berths.map_or(threads, Berths::lanes)
    }

    fn is_kept(&self, record: &DemoRecord) -> bool {
        let root = self.store.path();
        record.demonstration.as_ref().is_none_or(|demo| read_files(root, demo).is_ok())
    }
}

/// Reads the tables of an episode, and checks them and its images by their hashes; the error names what is missing or changed.
pub(crate) fn read_files(root: &Path, demo: &Demonstration) -> Result<[Table; 2], String> {
    let table = |file: &FileRecord| -> Result<Table, String> {
        let path = root.join(&file.path);
        let bytes = orchard_input::bytes(&path, orchard_input::RESULT).map_err(|e| e.to_string());
        let bytes = bytes.map_err(|e| format!("{}: {e}", file.path))?;
        if sha256(&bytes) != file.sha256 {
            return Err(format!("{}: does not match its SHA-256 in the record", file.path));
        }
        Table::from_parquet(bytes).map_err(|e| format!("{}: {e}", file.path))
    };
    let (steps, commands) = (table(&demo.steps)?, table(&demo.commands)?);
    let (mut digest, mut count) = (FilesDigest::default(), 0);
    for path in new_images(&steps) {
        let bytes = orchard_input::bytes(&root.join(path), orchard_input::RESULT);
        digest.add(path, &bytes.map_err(|e| format!("{path}: {e}"))?);
        count += 1;
    }
    if (count, hex(&digest.finish())) != (demo.images.count, demo.images.sha256.clone()) {
        return Err(format!("the images of {} do not match their SHA-256 in the record", demo.steps.path));
    }
    Ok([steps, commands])
}

/// Paths of the images of a table of steps, each once, in the order in which they were taken.
fn new_images(steps: &Table) -> Vec<&str> {
    let columns: Vec<&[String]> = steps
        .columns
        .iter()
        .filter(|(name, _)| name != "phase")
        .filter_map(|(_, column)| if let Column::Text(paths) = column { Some(&paths[..]) } else { None })
        .collect();
    let mut all = Vec::new();
    for row in 0..steps.rows() {
        for paths in &columns {
            if !paths[row].is_empty() && (row == 0 || paths[row] != paths[row - 1]) {
                all.push(paths[row].as_str());
            }
        }
    }
    all
}
