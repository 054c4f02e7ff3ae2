//! Interface of a task to the command: check, run, merge from parts.

use orchard_bench::PlanError;
use orchard_bench::compute::TaskCost;
use orchard_bench::store::Store;
use orchard_bench::task::{Task, finish, run_task};
use orchard_bench::{MergeError, OtherPlan, Record, RunError, Session, merge};
use orchard_tasks::harvest::matrix::ConditionError;
use serde::Serialize;

use super::bar::{Bar, RecordProgress};
use crate::failure::Failure;

/// Tells that a run ended with its graphics device, and why that was lost.
pub fn lost_device(why: &str) -> String {
    format!("the graphics device was lost: {why}; run the same command again to continue")
}

/// A task independent of the type of its records.
pub trait AnyTask {
    /// Checks that the task's records may be written into the folder.
    fn check(&self, store: &Store) -> Result<(), OtherPlan>;
    /// Runs a session's part of the task; prints the report if the session is the whole run.
    fn run(&self, session: &Session<'_>) -> Result<(), Failure>;
    /// Merges the parts in some folders into another folder, and prints the report.
    fn merge(&self, from: &[&Store], into: &Store) -> Result<(), Failure>;
}

/// A task with its progress lines and printed report.
pub trait PresentedTask {
    /// Type of the task's records.
    type Record: Record + Send;
    /// Summary of the records.
    type Summary: Serialize;
    /// The task itself.
    type Task<'a>: Task<Record = Self::Record, Summary = Self::Summary>
    where
        Self: 'a;

    /// The task itself.
    fn task(&self) -> Self::Task<'_>;
    /// Steps of the longest record.
    fn steps(&self) -> u64;
    /// Progress line of a record.
    fn shown(record: &Self::Record) -> RecordProgress;
    /// Prints a complete result and writes its files, except the summary.
    fn report(&self, summary: &Self::Summary, store: &Store) -> Result<(), Failure>;
    /// Reason for which a run could not go on, if it was neither the user's nor a file's.
    fn failed(&self) -> Option<String> {
        None
    }
    /// Copies the files that stand beside records from the folders of parts into another.
    fn merge_files(&self, records: &[Self::Record], from: &[&Store], into: &Store) -> Result<(), Failure> {
        let _ = (records, from, into);
        Ok(())
    }
}

impl<R: PresentedTask> AnyTask for R {
    fn check(&self, store: &Store) -> Result<(), OtherPlan> {
        store.check_plan::<R::Record>(&self.task().keys())
    }

    fn run(&self, session: &Session<'_>) -> Result<(), Failure> {
        let (task, name, store) = (self.task(), R::Task::NAME, session.store);
        let part = (0..task.keys().len()).filter(|place| session.shard.holds(*place)).count();
        let bar = Bar::new(name, part, self.steps(), R::shown);
        let result = run_task(&task, session, &bar);
        bar.clear();
        if let Some(why) = self.failed() {
            return Err(Failure::Failed(why));
        }
        let result = ended(result)?;
        match &result.summary {
            Some(summary) => end(self, summary, store)?,
            None => say!(
                "part {} of {name}: {} records in {}; `orchard merge` combines the parts",
                session.shard,
                result.records.len(),
                store.path().display()
            ),
        }
        say!("{}\n", spent(name, &result.cost, task.frame() > 0.0));
        Ok(())
    }

    fn merge(&self, from: &[&Store], into: &Store) -> Result<(), Failure> {
        let task = self.task();
        let records = merge(&task, from, into).map_err(|e| match e {
            MergeError::Missing(_) | MergeError::Differ { .. } => Failure::BadInput(e.to_string()),
            MergeError::Store(e) => Failure::Failed(e.to_string()),
        })?;
        self.merge_files(&records, from, into)?;
        let summary = finish(&task, &records, into).map_err(|e| Failure::Failed(e.to_string()))?;
        end(self, &summary, into)
    }
}

fn end<R: PresentedTask>(task: &R, summary: &R::Summary, store: &Store) -> Result<(), Failure> {
    task.report(summary, store)?;
    say!("results: {}", store.path().join(R::Task::SUMMARY).display());
    Ok(())
}

/// One line with the cost of a task.
fn spent(task: &str, cost: &TaskCost, moves: bool) -> String {
    let rate = |rate: Option<f64>| rate.map_or_else(|| "-".to_owned(), |rate| format!("{rate:.0}"));
    format!(
        "{task}: {:.0} s on {} threads; {} {} per second, {} on one thread; peak memory {} MiB",
        cost.wall_s,
        cost.threads,
        rate(cost.env_steps_per_s),
        if moves { "env-steps" } else { "images" },
        rate(cost.step_rate_per_s),
        rate(cost.peak_memory_mib)
    )
}

/// Converts a run's error into the command's failure.
fn ended<T>(result: Result<T, RunError>) -> Result<T, Failure> {
    result.map_err(|e| match e {
        RunError::Interrupted { .. } => Failure::Interrupted(e.to_string()),
        RunError::OtherPlan(e) => Failure::BadInput(format!("--out: {e}")),
        e => Failure::Failed(e.to_string()),
    })
}

impl From<orchard_quantity::ConfigError> for Failure {
    fn from(e: orchard_quantity::ConfigError) -> Self {
        Failure::BadInput(e.to_string())
    }
}

impl From<PlanError> for Failure {
    fn from(e: PlanError) -> Self {
        Failure::BadInput(e.to_string())
    }
}

impl From<ConditionError> for Failure {
    fn from(e: ConditionError) -> Self {
        Failure::BadInput(e.to_string())
    }
}
