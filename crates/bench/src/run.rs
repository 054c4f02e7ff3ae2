//! Runs every episode of a plan, in parallel, into a result folder.
//!
//! Episodes are independent and each has its own file, so the files depend neither on the number of threads
//! nor on the order of completion. A stored whole episode with the same key is reused.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use crate::compute::{Compute, EpisodeCost};
use crate::episode::{EpisodeKey, EpisodeRecord};
use crate::harness::{never_started, run_episode};
use crate::interface::{BenchController, BenchWorld};
use crate::plan::{Plan, PlanError};
use crate::store::{Store, StoreError, Stored};
use crate::summary::Summary;

/// Makes the worlds of a run, each with its controller.
pub trait WorldFactory: Sync {
    /// The worlds.
    type World: BenchWorld;
    /// Their controllers.
    type Controller: BenchController;
    /// Builds a world at the start of its episode.
    ///
    /// # Errors
    /// The world cannot be built, with the reason in one line; it counts as quarantined.
    fn build(&self, seed: u64, world: u32) -> Result<(Self::World, Self::Controller), String>;
}

/// Hears how a run goes on, from several threads.
pub trait Progress: Sync {
    /// A frame of some world was computed.
    fn frame(&self) {}
    /// An episode is there: computed now, or reused.
    fn episode(&self, record: &EpisodeRecord, reused: bool) {
        let _ = (record, reused);
    }
    /// Something that a user should know.
    fn note(&self, line: &str) {
        let _ = line;
    }
}

/// Hears nothing.
pub struct Silent;

impl Progress for Silent {}

/// A run that did not end.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The plan cannot be run.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A result file cannot be written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The stop flag was raised. Finished episodes are stored and will be reused.
    #[error("interrupted: {done} of {total} episodes are whole; the same command goes on from there")]
    Interrupted {
        /// Episodes stored.
        done: usize,
        /// Episodes planned.
        total: usize,
    },
}

/// A finished run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunResult {
    /// What was written to `summary.json`.
    pub summary: Summary,
    /// What was written to `compute.json`.
    pub compute: Compute,
    /// The records, in the order of [`Plan::episodes`].
    pub episodes: Vec<EpisodeRecord>,
}

/// Runs a plan on `threads` threads and writes `episodes/*.json`, `summary.json` and `compute.json`.
///
/// # Errors
/// The plan is unusable, a file cannot be written, or `stop` was raised.
pub fn run<F: WorldFactory>(
    plan: &Plan,
    factory: &F,
    store: &Store,
    threads: usize,
    stop: &AtomicBool,
    progress: &impl Progress,
) -> Result<RunResult, RunError> {
    plan.check()?;
    let start = Instant::now();
    let keys = plan.episodes();
    // Until this run has ended, the folder holds no summary, rather than one of other episodes.
    store.remove("summary.json")?;
    store.remove("compute.json")?;
    let names: Vec<String> = keys.iter().map(Store::episode_name).collect();
    for name in store.strangers(&names) {
        progress.note(&format!("{name} belongs to another run and is not part of the summary"));
    }

    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let done: Vec<Option<(EpisodeRecord, Option<f64>)>> = pool.install(|| {
        keys.par_iter()
            .with_max_len(1)
            .map(|key| episode(key, plan, factory, store, stop, progress))
            .collect::<Result<_, StoreError>>()
    })?;

    let total = keys.len();
    let whole = done.iter().flatten().count();
    if whole < total {
        return Err(RunError::Interrupted { done: whole, total });
    }
    let (episodes, walls): (Vec<EpisodeRecord>, Vec<Option<f64>>) = done.into_iter().flatten().unzip();
    let summary = Summary::of_run(plan, &episodes);
    let steps =
        episodes.iter().zip(&walls).filter(|(_, w)| w.is_some()).map(|(e, _)| u64::from(e.frames)).sum();
    let costs = names.into_iter().zip(walls).map(|(file, wall_s)| EpisodeCost { file, wall_s }).collect();
    let compute = Compute::of_run(threads as u32, start.elapsed().as_secs_f64(), steps, plan.frame, costs);
    store.write("compute.json", &compute)?;
    store.write("summary.json", &summary)?;
    Ok(RunResult { summary, compute, episodes })
}

/// One episode and its wall time [s], if computed now; `None` if stopped.
fn episode<F: WorldFactory>(
    key: &EpisodeKey,
    plan: &Plan,
    factory: &F,
    store: &Store,
    stop: &AtomicBool,
    progress: &impl Progress,
) -> Result<Option<(EpisodeRecord, Option<f64>)>, StoreError> {
    match store.stored(key) {
        Stored::Whole(record) => {
            progress.episode(&record, true);
            return Ok(Some((*record, None)));
        }
        Stored::Damaged => {
            progress.note(&format!("{} is damaged and is computed again", Store::episode_name(key)));
        }
        Stored::Missing | Stored::Other => {}
    }
    if stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    let start = Instant::now();
    let record = match factory.build(key.seed, key.world) {
        Err(reason) => never_started(key.clone(), reason),
        Ok((mut world, mut controller)) => {
            let on_frame = &mut || progress.frame();
            let (protocol, frame) = (&plan.protocol, plan.frame);
            match run_episode(key.clone(), &mut world, &mut controller, protocol, frame, stop, on_frame) {
                Some(record) => record,
                None => return Ok(None),
            }
        }
    };
    store.write_episode(&record)?;
    progress.episode(&record, false);
    Ok(Some((record, Some(start.elapsed().as_secs_f64()))))
}
