//! Runs any task of the benchmark: a list of independent pieces of work, each with a record in a file of its own.
//!
//! A [`Task`] lists the keys of its records and computes each of them. [`run_task`] computes them in parallel into a result folder
//! ([`store::Store`]), reuses records that are already stored, and writes their cost ([`compute`]) and the summary. A [`Shard`] is a
//! part of a run for one of several machines; [`merge`] combines the parts. The tasks themselves are in `orchard-tasks` and
//! `orchard-scaling`.

pub mod atomic_file;
mod check;
pub mod checksum;
pub mod compute;
pub mod digest;
mod disk;
#[cfg(test)]
mod fake;
#[cfg(test)]
mod fake_task;
#[cfg(any(test, feature = "faults"))]
pub mod faults;
#[cfg(test)]
mod faults_tests;
mod folder;
mod folder_check;
mod gather;
pub mod lock;
pub mod record;
mod shard;
pub mod store;
#[cfg(any(test, feature = "faults"))]
pub mod sweep;
pub mod task;
mod version;

pub use check::{MOST_RECORDS, PlanError, check_records, check_trees};
pub use folder_check::OtherPlan;
pub use gather::{MergeError, Missing, gather, merge};
pub use record::Record;
pub use shard::Shard;
pub use task::{NoProgress, Progress, RunError, Session, Task, run_task};
pub use version::{CODE_VERSION, SCHEMA_VERSION};
