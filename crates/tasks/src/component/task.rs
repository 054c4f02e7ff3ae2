//! The interface of a component task.

use std::fmt::Debug;

use orchard_picker::Goal;
use orchard_world::World;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::component::rules::ComponentRules;

/// A component task.
pub trait Component: Debug + Clone + PartialEq + Send + Sync + 'static {
    /// Target of a trial.
    type Target: Serialize + DeserializeOwned + Debug + Clone + PartialEq + Send + Sync;
    /// Name on command lines and in results; also the folder of its records.
    const NAME: &'static str;
    /// File of its summary.
    const SUMMARY: &'static str;

    /// The targets of a tree, in the order of their trials; a function of seed and world.
    fn targets(world: &World, rules: &ComponentRules, seed: u64) -> Vec<Self::Target>;

    /// Returns the goal given to the controller.
    fn goal(target: &Self::Target) -> Goal;

    /// Longest trial \[s\].
    fn time(rules: &ComponentRules) -> f64;

    /// Frames for which [`Self::is_met`] must hold without a break; at least 1.
    fn hold_frames(rules: &ComponentRules, frame: f64) -> u32;

    /// True if the world meets the target now.
    fn is_met(world: &World, target: &Self::Target, rules: &ComponentRules) -> bool;

    /// Number of the first of the next frames, each of a length \[s\], after which the world may meet the target if nothing touches wood or fruit in them; at least 1.
    fn frames_to_meet(world: &World, target: &Self::Target, rules: &ComponentRules, frame: f64) -> u32;

    /// Returns the fruit whose detachment is not counted as damage.
    fn named_fruit(target: &Self::Target) -> Option<u32>;

    /// Largest number of trials per tree.
    fn trials(rules: &ComponentRules) -> u32;
}
