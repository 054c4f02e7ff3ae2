//! Runs every episode of a plan, in parallel, into a result folder.
//!
//! Episodes are the records of a [`Task`]: independent, each with its own file.

use std::marker::PhantomData;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use crate::compute::{Compute, EpisodeCost};
use crate::episode::{EpisodeKey, EpisodeRecord};
use crate::harness::{never_started, watch_episode};
use crate::interface::{BenchController, BenchWorld};
use crate::observe::{KeepNothing, Watch};
use crate::plan::Plan;
use crate::record::Record;
use crate::store::{Store, StoreError};
use crate::summary::Summary;
use crate::task::{Progress, RunError, Task, run_task};

/// Makes the worlds of a run, each with its controller.
pub trait WorldFactory: Sync {
    /// The worlds.
    type World: BenchWorld;
    /// Their controllers.
    type Controller: BenchController;
    /// Builds a world at the start of its episode. A repeat differs from the others in the robot's start pose and in nothing else.
    ///
    /// # Errors
    /// The world cannot be built, with the reason in one line; it counts as quarantined.
    fn build(&self, seed: u64, world: u32, repeat: u32) -> Result<(Self::World, Self::Controller), String>;
}

const SUMMARY: &str = "summary.json";
const COMPUTE: &str = "compute.json";

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
/// The plan is unusable, the folder holds another one's records, a file cannot be written, or `stop` was raised.
pub fn run<F: WorldFactory>(
    plan: &Plan,
    factory: &F,
    store: &Store,
    threads: usize,
    stop: &AtomicBool,
    progress: &impl Progress<EpisodeRecord>,
) -> Result<RunResult, RunError> {
    run_watched(plan, factory, store, threads, stop, progress, &KeepNothing(PhantomData))
}

/// [`run`] with somebody who watches every episode.
///
/// # Errors
/// As [`run`].
pub fn run_watched<F: WorldFactory>(
    plan: &Plan,
    factory: &F,
    store: &Store,
    threads: usize,
    stop: &AtomicBool,
    progress: &impl Progress<EpisodeRecord>,
    watch: &impl Watch<F::World>,
) -> Result<RunResult, RunError> {
    plan.check()?;
    let start = Instant::now();
    let done = run_task(&Episodes { plan, factory, watch }, store, threads, stop, progress)?;
    let (episodes, walls): (Vec<EpisodeRecord>, Vec<Option<f64>>) = done.into_iter().unzip();
    let summary = Summary::of_run(plan, &episodes);
    let steps =
        episodes.iter().zip(&walls).filter(|(_, w)| w.is_some()).map(|(e, _)| u64::from(e.frames)).sum();
    let files = episodes.iter().map(|e| EpisodeRecord::path(&e.key));
    let costs = files.zip(walls).map(|(file, wall_s)| EpisodeCost { file, wall_s }).collect();
    let compute = Compute::of_run(threads as u32, start.elapsed().as_secs_f64(), steps, plan.frame, costs);
    store.write(COMPUTE, &compute)?;
    store.write(SUMMARY, &summary)?;
    Ok(RunResult { summary, compute, episodes })
}

/// The harvest task: an episode of every world of a plan.
struct Episodes<'a, F, O> {
    plan: &'a Plan,
    factory: &'a F,
    watch: &'a O,
}

impl<F: WorldFactory, O: Watch<F::World>> Task for Episodes<'_, F, O> {
    type Record = EpisodeRecord;
    const RESULTS: &'static [&'static str] = &[SUMMARY, COMPUTE];

    fn keys(&self) -> Vec<EpisodeKey> {
        self.plan.episodes()
    }

    fn compute(
        &self,
        key: &EpisodeKey,
        stop: &AtomicBool,
        on_step: &mut dyn FnMut(),
    ) -> Result<Option<EpisodeRecord>, StoreError> {
        let (mut world, mut controller) = match self.factory.build(key.seed, key.world, key.repeat) {
            Ok(built) => built,
            Err(reason) => return Ok(Some(never_started(key.clone(), reason))),
        };
        let (protocol, frame) = (&self.plan.protocol, self.plan.frame);
        let mut observer = self.watch.begin(key, &world);
        let (key, world, controller) = (key.clone(), &mut world, &mut controller);
        let record = watch_episode(key, world, controller, protocol, frame, stop, on_step, &mut observer);
        if let Some(record) = &record {
            self.watch.end(observer, world, record)?;
        }
        Ok(record)
    }

    fn is_kept(&self, record: &EpisodeRecord) -> bool {
        // A world that was never built has nothing to watch.
        record.fruit_total == 0 && record.frames == 0 || self.watch.is_kept(&record.key)
    }
}
