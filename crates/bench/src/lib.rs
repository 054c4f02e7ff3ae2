//! The OrchardBench benchmark: tasks, metrics, zones, statistics and records.
//!
//! plan -> episodes (world and controller, frame by frame) -> records -> metrics -> summary. `docs/benchmark-v1.md`
//! states what each figure means.

pub mod adapter;
mod attempts;
pub mod component;
pub mod compute;
pub mod dataset;
pub mod detect;
mod digest;
pub mod episode;
#[cfg(test)]
mod fake;
mod gather;
pub mod growing;
mod harness;
#[cfg(test)]
mod harness_tests;
pub mod harvest;
mod hold;
mod holdings;
pub mod interface;
pub mod leaderboard;
mod matching;
pub mod matrix;
pub mod metrics;
pub mod observe;
pub mod plan;
pub mod plan_file;
pub mod protocol;
mod reason;
pub mod record;
mod run;
#[cfg(test)]
mod run_tests;
pub mod scaling;
pub mod seeds;
mod shard;
mod stall;
pub mod statistics;
pub mod store;
pub mod summary;
pub mod task;
mod trial;
pub mod vantage;
pub mod verify;
#[cfg(test)]
mod watch;
pub mod zones;

pub use gather::{MergeError, Missing, gather, merge};
pub use harness::{run_episode, watch_episode};
pub use holdings::OtherPlan;
pub use record::Record;
pub use run::{Episodes, RunResult, WorldFactory, run};
pub use shard::Shard;
pub use task::{Progress, RunError, Session, Silent, run_task};
pub use trial::trial;
