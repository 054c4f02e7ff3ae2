//! Runs every episode of a plan, in parallel, into a result folder.
//!
//! Episodes are the records of a [`Task`]: independent, each with its own file.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use crate::compute::{Compute, EpisodeCost};
use crate::episode::{EpisodeKey, EpisodeRecord};
use crate::harness::{never_started, run_episode};
use crate::interface::{BenchController, BenchWorld};
use crate::plan::Plan;
use crate::record::Record;
use crate::store::Store;
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

/// Name of the summary of a harvest.
pub(crate) const SUMMARY: &str = "summary.json";
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
    plan.check()?;
    let start = Instant::now();
    let done = run_task(&Episodes { plan, factory }, store, threads, stop, progress)?;
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
pub(crate) struct Episodes<'a, F> {
    pub(crate) plan: &'a Plan,
    pub(crate) factory: &'a F,
}

impl<F: WorldFactory> Task for Episodes<'_, F> {
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
    ) -> Option<EpisodeRecord> {
        match self.factory.build(key.seed, key.world, key.repeat) {
            Err(reason) => Some(never_started(key.clone(), reason)),
            Ok((mut world, mut controller)) => {
                let (protocol, frame) = (&self.plan.protocol, self.plan.frame);
                run_episode(key.clone(), &mut world, &mut controller, protocol, frame, stop, on_step)
            }
        }
    }
}
