//! The robot's start and the reach rule of an episode.

use orchard_quantity::{Count, Quantity, Span};
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
    /// Grid on which reachability is tested.
    pub reach_grid: ReachGridSpec,
    /// Start pose of the robot.
    pub start: StartSpec,
}

/// Grid on which reachability is tested: places of the base around a fruit, and approaches of the arm from each place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReachGridSpec {
    /// Bearings around the fruit, equally spaced over the full turn.
    pub bearings: Count,
    /// Distances along each bearing, equally spaced over the admissible interval, both ends included.
    pub stand_offs: Count,
    /// Slopes of the approach that inverse kinematics tries on each side of the horizontal.
    pub slopes: Count,
    /// Angle from one slope to the next.
    pub slope_step: Quantity,
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
