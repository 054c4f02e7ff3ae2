//! The harvest task: a controller picks fruit for a limited time, under every condition of the matrix.
//!
//! plan -> episodes (world and controller, frame by frame) -> records -> metrics -> summary. [`Harvest`] makes the worlds of a scenario,
//! [`run`] computes a plan into a result folder, [`trial`] runs a single episode. `docs/benchmark-v1.md` defines the figures.

pub mod adapter;
mod attempts;
pub mod command_log;
mod contacts;
pub mod episode;
pub(crate) mod harness;
#[cfg(test)]
mod harness_tests;
mod hold;
pub mod interface;
pub mod matrix;
pub mod metrics;
pub mod observe;
pub mod plan;
mod reason;
pub mod replays;
pub(crate) mod run;
#[cfg(test)]
mod run_tests;
pub mod summary;
mod trial;
mod worlds;

pub use harness::{census, never_started, outcome_of, run_episode, run_observed_episode};
pub use plan::Extent;
pub use run::{Episodes, RunResult, WorldFactory, run};
pub use trial::trial;
pub use worlds::Harvest;
