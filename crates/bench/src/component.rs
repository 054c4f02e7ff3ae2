//! Component tasks: one skill at a time, each on targets that the task names.
//!
//! `reach-and-grasp`: hold a named fruit. `gentle`: push the hand to a point behind the canopy. trees -> targets (seeded) -> trials
//! (world and controller, frame by frame) -> records -> metrics -> summary. `docs/benchmark-v1.md` states what each figure means.

mod gentle;
mod grasp;
mod metrics;
mod plan;
mod record;
mod rules;
mod run;
mod summary;
#[cfg(test)]
mod tests;
mod trial;

pub use gentle::{Gentle, PointTarget};
pub use grasp::{FruitTarget, ReachAndGrasp};
pub use metrics::metrics;
pub use plan::{ComponentKey, ComponentPlan, ComponentRun};
pub use record::{Ended, TreeRecord, TrialRecord};
pub use rules::{ComponentRules, GentleRules, GraspRules};
pub use run::{ComponentResult, Trials, run};
pub use summary::{ComponentSummary, TreeLine};

use std::fmt::Debug;

use orchard_picker::Goal;
use orchard_world::World;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A component task.
pub trait Component: Debug + Clone + PartialEq + Send + Sync + 'static {
    /// What a trial is about.
    type Target: Serialize + DeserializeOwned + Debug + Clone + PartialEq + Send + Sync;
    /// Name on command lines and in results; also the folder of its records.
    const NAME: &'static str;
    /// File of its summary.
    const SUMMARY: &'static str;

    /// The targets of a tree, in the order of their trials; a function of seed and world.
    fn targets(world: &World, rules: &ComponentRules, seed: u64) -> Vec<Self::Target>;

    /// What the controller is told.
    fn goal(target: &Self::Target) -> Goal;

    /// Longest trial [s].
    fn time(rules: &ComponentRules) -> f64;

    /// Frames for which [`Self::is_met`] must hold without a break; at least 1.
    fn hold_frames(rules: &ComponentRules, frame: f64) -> u32;

    /// Whether the world shows what was asked for, now.
    fn is_met(world: &World, target: &Self::Target, rules: &ComponentRules) -> bool;

    /// The fruit that it is no fault to take off.
    fn named_fruit(target: &Self::Target) -> Option<u32>;

    /// Trials a tree at most.
    fn trials(rules: &ComponentRules) -> u32;
}
