//! The robot's start and the reach rule of an episode.

use orchard_quantity::{Quantity, Span};
use serde::{Deserialize, Serialize};

/// The paper's rule: a fruit is reachable if its centre lies within the arm's reach sphere from an admissible
/// stand-off.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodeSpec {
    /// Radius of the arm's reach sphere about its shoulder, to the point between the finger pads.
    pub reach_radius: Quantity,
    /// Admissible horizontal distance from the arm's shoulder to the fruit.
    pub stand_off: Span,
    /// Start pose of the robot.
    pub start: StartSpec,
}

/// Start pose of the robot's base, drawn for every world. Its bearing from the trunk is drawn from all that the scenery allows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartSpec {
    /// Horizontal distance from the trunk to the base.
    pub distance: Span,
    /// Turn from facing the trunk, positive to the left.
    pub heading: Span,
}
