//! The interface of a task environment in words that a machine can read.

use serde::Serialize;

use crate::settings::Task;

/// A term of the reward.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Term {
    /// Name.
    pub name: &'static str,
    /// Weight; the damage's is subtracted.
    pub weight: f64,
}

/// All conventions of a task environment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Interface {
    /// Version of the figures of `configs/learning/`.
    pub version: String,
    /// The task.
    pub task: Task,
    /// The task in words.
    pub task_description: &'static str,
    /// Hash of the scenario.
    pub scenario: String,
    /// Longest episode \[s\].
    pub horizon: f64,
    /// True if the first term alone is rewarded.
    pub sparse: bool,
    /// The terms of the reward, in the order of [`crate::Report::terms`].
    pub reward: Vec<Term>,
    /// Observations and actions.
    #[serde(flatten)]
    pub policy: orchard_policy::Interface,
}
