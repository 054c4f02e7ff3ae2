//! A task of the benchmark: independent pieces of work, each with a record in a file of its own.
//!
//! Records depend neither on the number of threads nor on the order of completion. A complete stored record with the same key
//! is reused, so that an interrupted run continues where it stopped. A record whose checksum is wrong is computed again, and a note
//! names it: nothing is lost, because the key determines the record.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

use crate::check::PlanError;
use crate::compute::{Compute, RecordCost, TaskCost};
use crate::folder_check::OtherPlan;
use crate::record::Record;
use crate::shard::Shard;
use crate::store::{Store, StoreError, Stored};

/// A task.
pub trait Task: Sync {
    /// Record of one piece of work.
    type Record: Record + Send;
    /// Summary of all records.
    type Summary: Serialize;
    /// Name on command lines and in results.
    const NAME: &'static str;
    /// The summary's file under the result folder. An old one is deleted when a run starts.
    const SUMMARY: &'static str;
    /// Checks the user's input.
    ///
    /// # Errors
    /// A plan that cannot be run.
    fn check(&self) -> Result<(), PlanError>;
    /// Keys of all records, in the order of the results.
    fn keys(&self) -> Vec<<Self::Record as Record>::Key>;
    /// Computes one record; `None` if `stop` was raised before its end. `on_step` is called after every step.
    ///
    /// # Errors
    /// A file that belongs to the record cannot be written.
    fn compute(
        &self,
        key: &<Self::Record as Record>::Key,
        stop: &AtomicBool,
        on_step: &mut dyn FnMut(),
    ) -> Result<Option<Self::Record>, StoreError>;
    /// Steps that a record took.
    fn steps(&self, record: &Self::Record) -> u64;
    /// Simulated time of a step \[s\]; 0 for tasks without motion.
    fn frame(&self) -> f64;
    /// Sums up all records, given in the order of [`Task::keys`].
    fn sum_up(&self, records: &[Self::Record]) -> Self::Summary;
    /// Records that are computed at once by a session of some threads.
    fn at_once(&self, threads: usize) -> usize {
        threads
    }
    /// True if the files that belong to a record besides its own exist; otherwise the record is computed again.
    fn is_kept(&self, record: &Self::Record) -> bool {
        let _ = record;
        true
    }
}

/// Progress of a run; its methods are called from several threads.
pub trait Progress<R>: Sync {
    /// Called after each step: a frame of some world, an image.
    fn step(&self) {}
    /// Called with each record, computed now or reused.
    fn record(&self, record: &R, reused: bool) {
        let _ = (record, reused);
    }
    /// Called with a note for the user.
    fn note(&self, line: &str) {
        let _ = line;
    }
}

/// Ignores everything.
pub struct NoProgress;

impl<R> Progress<R> for NoProgress {}

/// A run that did not end.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The plan cannot be run.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The folder holds another plan's records.
    #[error(transparent)]
    OtherPlan(#[from] OtherPlan),
    /// A result file cannot be written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The stop flag was raised. Finished records are stored and will be reused.
    #[error("interrupted: {done} of {total} {folder} are complete; run the same command again to continue")]
    Interrupted {
        /// Folder of the records.
        folder: &'static str,
        /// Records stored.
        done: usize,
        /// Records planned.
        total: usize,
    },
}

/// Folder, threads and part of a run.
#[derive(Clone, Copy)]
pub struct Session<'a> {
    /// The result folder.
    pub store: &'a Store,
    /// Threads.
    pub threads: usize,
    /// The part of the records that is computed.
    pub shard: Shard,
    /// Stop flag: when raised, the run ends with complete files only.
    pub stop: &'a AtomicBool,
}

impl<'a> Session<'a> {
    /// A session that computes all records.
    pub fn whole(store: &'a Store, threads: usize, stop: &'a AtomicBool) -> Self {
        Self { store, threads, shard: Shard::WHOLE, stop }
    }
}

/// A run that ended.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskResult<R, S> {
    /// Summary as written; none for a part of a run.
    pub summary: Option<S>,
    /// Cost as written to `compute.json`.
    pub cost: TaskCost,
    /// The records of the session's part, in the order of [`Task::keys`].
    pub records: Vec<R>,
}

/// Computes or reuses every record of a session's part of a task; writes them, their cost, and the summary of a whole run.
///
/// # Errors
/// The plan is unusable, the folder holds another one's records, a file cannot be written, or `stop` was raised.
pub fn run_task<T: Task>(
    task: &T,
    session: &Session<'_>,
    progress: &impl Progress<T::Record>,
) -> Result<TaskResult<T::Record, T::Summary>, RunError> {
    task.check()?;
    let start = Instant::now();
    let done = records(task, session, progress)?;
    let (records, walls): (Vec<T::Record>, Vec<Option<f64>>) = done.into_iter().unzip();
    let computed = records.iter().zip(&walls).filter(|(_, wall)| wall.is_some());
    let steps = computed.map(|(record, _)| task.steps(record)).sum();
    let files = records.iter().map(|record| T::Record::path(record.key()));
    let costs = files.zip(walls).map(|(file, wall_s)| RecordCost { file, wall_s }).collect();
    let wall_s = start.elapsed().as_secs_f64();
    let cost = TaskCost::of_run(session.threads, wall_s, steps, task.frame(), costs);
    Compute::note(session.store, T::NAME, cost.clone())?;
    let summary = session.shard.is_whole().then(|| finish(task, &records, session.store)).transpose()?;
    Ok(TaskResult { summary, cost, records })
}

/// Sums up all records of a task, given in the order of [`Task::keys`], and writes the summary.
///
/// # Errors
/// The file cannot be written, or the file of a record is no longer there.
pub fn finish<T: Task>(task: &T, records: &[T::Record], store: &Store) -> Result<T::Summary, StoreError> {
    store.check_files(records.iter().map(|record| T::Record::path(record.key())))?;
    let summary = task.sum_up(records);
    store.write(T::SUMMARY, &summary)?;
    Ok(summary)
}

/// A record and the wall time that it took \[s\], if computed now.
type Timed<R> = (R, Option<f64>);

fn records<T: Task>(
    task: &T,
    session: &Session<'_>,
    progress: &impl Progress<T::Record>,
) -> Result<Vec<Timed<T::Record>>, RunError> {
    let Session { store, threads, shard, stop } = *session;
    let all = task.keys();
    store.check_plan::<T::Record>(&all)?;
    store.remove(T::SUMMARY)?;
    let own: Vec<String> = all.iter().map(T::Record::path).collect();
    for name in store.files(T::Record::FOLDER).iter().filter(|name| !own.contains(name)) {
        progress.note(&format!("{name} is not a record and is ignored"));
    }
    let part = all.into_iter().enumerate().filter(|(place, _)| shard.holds(*place));
    let keys: Vec<_> = part.map(|(_, key)| key).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(task.at_once(threads)).build()?;
    let done: Vec<Option<Timed<T::Record>>> = pool.install(|| {
        keys.par_iter()
            .with_max_len(1)
            .map(|key| one(task, key, store, stop, progress))
            .collect::<Result<_, StoreError>>()
    })?;
    let (total, whole) = (keys.len(), done.iter().flatten().count());
    if whole < total {
        return Err(RunError::Interrupted { folder: T::Record::FOLDER, done: whole, total });
    }
    Ok(done.into_iter().flatten().collect())
}

/// One record; `None` if stopped.
fn one<T: Task>(
    task: &T,
    key: &<T::Record as Record>::Key,
    store: &Store,
    stop: &AtomicBool,
    progress: &impl Progress<T::Record>,
) -> Result<Option<Timed<T::Record>>, StoreError> {
    match store.stored::<T::Record>(key) {
        Stored::Whole(record) if task.is_kept(&record) => {
            progress.record(&record, true);
            return Ok(Some((*record, None)));
        }
        Stored::Damaged => {
            let file = T::Record::path(key);
            progress.note(&format!("{file} is damaged or was edited: it will be computed again"));
        }
        Stored::Whole(_) | Stored::Missing | Stored::Other => {}
    }
    if stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    let start = Instant::now();
    let computed = task.compute(key, stop, &mut || progress.step());
    // A file beside the record that cannot be written may only show that the folder has gone.
    let computed = computed.map_err(|e| store.check().err().unwrap_or(e))?;
    let Some(record) = computed else { return Ok(None) };
    store.write_record(&record)?;
    progress.record(&record, false);
    Ok(Some((record, Some(start.elapsed().as_secs_f64()))))
}
