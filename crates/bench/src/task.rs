//! A task of the benchmark: independent pieces of work, each with a record in a file of its own.
//!
//! Records depend neither on the number of threads nor on the order of completion. A stored whole record with the same key
//! is reused, so that an interrupted run goes on where it stopped.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use crate::holdings::OtherPlan;
use crate::plan::PlanError;
use crate::record::Record;
use crate::store::{Store, StoreError, Stored};

/// A task.
pub trait Task: Sync {
    /// Its records.
    type Record: Record + Send;
    /// Files that a run writes from all records at its end. Until then the folder holds none, rather than old ones.
    const RESULTS: &'static [&'static str];
    /// What is to be computed, in the order of the results.
    fn keys(&self) -> Vec<<Self::Record as Record>::Key>;
    /// Computes one record; `None` if `stop` was raised before its end. `on_step` is called after every step.
    ///
    /// # Errors
    /// A file that the task keeps beside the record cannot be written.
    fn compute(
        &self,
        key: &<Self::Record as Record>::Key,
        stop: &AtomicBool,
        on_step: &mut dyn FnMut(),
    ) -> Result<Option<Self::Record>, StoreError>;
    /// Whether the files that the task keeps beside a record are there; else the record is computed again.
    fn is_kept(&self, record: &Self::Record) -> bool {
        let _ = record;
        true
    }
}

/// Hears how a run goes on, from several threads.
pub trait Progress<R>: Sync {
    /// A step was computed: a frame of some world, an image.
    fn step(&self) {}
    /// A record is there: computed now, or reused.
    fn record(&self, record: &R, reused: bool) {
        let _ = (record, reused);
    }
    /// Something that a user should know.
    fn note(&self, line: &str) {
        let _ = line;
    }
}

/// Hears nothing.
pub struct Silent;

impl<R> Progress<R> for Silent {}

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
    #[error("interrupted: {done} of {total} {folder} are whole; the same command goes on from there")]
    Interrupted {
        /// Folder of the records.
        folder: &'static str,
        /// Records stored.
        done: usize,
        /// Records planned.
        total: usize,
    },
}

/// A record and the wall time that it took [s], if computed now.
pub type Timed<R> = (R, Option<f64>);

/// Computes or reuses every record of a task on `threads` threads, in the order of [`Task::keys`].
///
/// # Errors
/// The folder holds another plan's records, a file cannot be written, or `stop` was raised.
pub fn run_task<T: Task>(
    task: &T,
    store: &Store,
    threads: usize,
    stop: &AtomicBool,
    progress: &impl Progress<T::Record>,
) -> Result<Vec<Timed<T::Record>>, RunError> {
    let keys = task.keys();
    store.check_plan::<T::Record>(&keys)?;
    for name in T::RESULTS {
        store.remove(name)?;
    }
    let own: Vec<String> = keys.iter().map(T::Record::path).collect();
    for name in store.files(T::Record::FOLDER).iter().filter(|name| !own.contains(name)) {
        progress.note(&format!("{name} is no record and is left alone"));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
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
            progress.note(&format!("{} is damaged and is computed again", T::Record::path(key)));
        }
        Stored::Whole(_) | Stored::Missing | Stored::Other => {}
    }
    if stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    let start = Instant::now();
    let Some(record) = task.compute(key, stop, &mut || progress.step())? else { return Ok(None) };
    store.write_record(&record)?;
    progress.record(&record, false);
    Ok(Some((record, Some(start.elapsed().as_secs_f64()))))
}
