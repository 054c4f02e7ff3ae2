//! Runs every episode of a plan, in parallel, into a result folder.
//!
//! Episodes are the records of a [`Task`]: independent, each with its own file.

use std::sync::atomic::AtomicBool;

use orchard_bench::PlanError;
use orchard_bench::store::StoreError;
use orchard_bench::task::{Progress, RunError, Session, Task, TaskResult, run_task};

use crate::harvest::episode::{EpisodeKey, EpisodeRecord};
use crate::harvest::harness::{never_started, run_observed_episode};
use crate::harvest::interface::{BenchController, BenchWorld};
use crate::harvest::observe::{NoObservers, ObserverFactory};
use crate::harvest::plan::Plan;
use crate::harvest::summary::Summary;

/// Makes the worlds of a run and their controllers.
pub trait WorldFactory: Sync {
    /// Type of the worlds.
    type World: BenchWorld;
    /// Type of the controllers.
    type Controller: BenchController;
    /// Builds the world of a condition, seed, index and repeat at the start of its episode. Repeats differ only in the robot's start pose.
    ///
    /// # Errors
    /// The world cannot be built (reason in one line); it then counts as quarantined.
    fn build(&self, key: &EpisodeKey) -> Result<(Self::World, Self::Controller), String>;
    /// Reason for which the worlds have stopped moving, if they have: no episode since then has a record.
    fn failed(&self) -> Option<String> {
        None
    }
    /// Episodes that run at once in a session of some threads.
    fn at_once(&self, threads: usize) -> usize {
        threads
    }
}

/// A finished run.
pub type RunResult = TaskResult<EpisodeRecord, Summary>;

/// Runs a session's part of a plan: writes `episodes/*.json`, `compute.json`, and for a whole run `summary.json`.
///
/// # Errors
/// The plan is invalid, the folder holds records of another plan, a file cannot be written, or `stop` was raised.
pub fn run<F: WorldFactory>(
    plan: &Plan,
    factory: &F,
    session: &Session<'_>,
    progress: &impl Progress<EpisodeRecord>,
) -> Result<RunResult, RunError> {
    run_task(&Episodes::unwatched(plan, factory), session, progress)
}

/// The harvest task: every episode of a plan.
pub struct Episodes<'a, F, O> {
    /// The plan.
    pub plan: &'a Plan,
    /// Worlds.
    pub factory: &'a F,
    /// Observers.
    pub watch: &'a O,
}

impl<'a, F> Episodes<'a, F, NoObservers> {
    /// Makes the task of a plan without observers.
    pub fn unwatched(plan: &'a Plan, factory: &'a F) -> Self {
        Self { plan, factory, watch: &NoObservers }
    }
}

impl<F: WorldFactory, O: ObserverFactory<F::World>> Task for Episodes<'_, F, O> {
    type Record = EpisodeRecord;
    type Summary = Summary;
    const NAME: &'static str = "harvest";
    const SUMMARY: &'static str = "summary.json";

    fn check(&self) -> Result<(), PlanError> {
        self.plan.check()
    }

    fn keys(&self) -> Vec<EpisodeKey> {
        self.plan.episodes()
    }

    fn compute(
        &self,
        key: &EpisodeKey,
        stop: &AtomicBool,
        on_step: &mut dyn FnMut(),
    ) -> Result<Option<EpisodeRecord>, StoreError> {
        let (mut world, mut controller) = match self.factory.build(key) {
            Ok(built) => built,
            Err(reason) => return Ok(Some(never_started(key.clone(), reason))),
        };
        let (protocol, frame) = (&self.plan.protocol, self.plan.frame);
        let mut observer = self.watch.begin(key, &world);
        let (key, world, controller) = (key.clone(), &mut world, &mut controller);
        let record =
            run_observed_episode(key, world, controller, protocol, frame, stop, on_step, &mut observer);
        if self.factory.failed().is_some() {
            return Ok(None);
        }
        if let Some(record) = &record {
            self.watch.end(observer, world, record)?;
        }
        Ok(record)
    }

    fn at_once(&self, threads: usize) -> usize {
        self.factory.at_once(threads)
    }

    fn is_kept(&self, record: &EpisodeRecord) -> bool {
        // A world that could not be built has no observer.
        record.fruit_total == 0 && record.frames == 0 || self.watch.is_kept(record)
    }

    fn steps(&self, record: &EpisodeRecord) -> u64 {
        u64::from(record.frames)
    }

    fn frame(&self) -> f64 {
        self.plan.frame
    }

    fn sum_up(&self, records: &[EpisodeRecord]) -> Summary {
        Summary::of_run(self.plan, records)
    }
}
