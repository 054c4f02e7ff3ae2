//! The interface of a task environment in words that a machine can read.

use orchard_quantity::Quantity;
use serde::Serialize;

use crate::settings::{Pool, Task};

/// A term of the reward.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Term {
    /// Name.
    pub name: &'static str,
    /// Weight; those of damage and impulse are subtracted.
    pub weight: f64,
}

/// A term with the weight that a config gives it.
pub(crate) fn term(name: &'static str, weight: &Quantity) -> Term {
    Term { name, weight: weight.si() }
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
    /// Robot.
    pub robot: String,
    /// Hash of the scene: world, robot, camera, detector and rules of the scenario, without its controller.
    pub scenario: String,
    /// Longest episode \[s\].
    pub horizon: f64,
    /// True if the first term alone is rewarded.
    pub sparse: bool,
    /// True if truth is observed: no policy that reads it can be ranked.
    pub privileged: bool,
    /// Worlds in which all episodes begin, if they are kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pool: Option<Pool>,
    /// The terms of the reward, in the order of [`crate::Report::terms`].
    pub reward: Vec<Term>,
    /// Observations and actions.
    #[serde(flatten)]
    pub policy: orchard_policy::Interface,
}
