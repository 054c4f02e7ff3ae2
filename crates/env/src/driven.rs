//! Episodes that a controller of the benchmark drives: demonstrations for policies.

use orchard_robot::Command;
use serde::{Deserialize, Serialize};

/// By which way a controller's commands reach the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Via {
    /// Frame by frame, as in the benchmark. The action of a step is the one that comes nearest to its commands, found afterwards.
    Commands,
    /// Through the encoding of a policy: the command of a step's first frame, carried on by its speeds, is turned into the action, and the
    /// action's motion moves the robot. The controller sees every frame, its other commands are not executed.
    Actions,
}

/// A step that a controller took.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    /// The action.
    pub action: Vec<f32>,
    /// Largest difference between the action's motion and the controller's commands, by channel, in the channel's unit.
    pub error: Vec<f64>,
    /// The commands that moved the robot, one a frame; fewer than an action has frames where the episode ended.
    pub commands: Vec<Command>,
}
