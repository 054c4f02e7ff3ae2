//! The component tasks' constants: `[component]` of `configs/bench/v1.toml`.

use orchard_quantity::{Count, Quantity, Span};
use serde::{Deserialize, Serialize};

/// The component tasks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComponentRules {
    /// Reach and grasp.
    pub grasp: GraspRules,
    /// Gentle interaction.
    pub gentle: GentleRules,
}

/// Reach and grasp of a named fruit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GraspRules {
    /// Fruit per tree.
    pub targets: Count,
    /// Longest trial.
    pub time: Quantity,
    /// Time for which both fingers must press on the fruit without a break.
    pub hold: Quantity,
    /// Standard deviation of the error of the given centre, per axis.
    pub centre_error: Quantity,
    /// Standard deviation of the radius.
    pub radius_error: Quantity,
}

/// Gentle interaction: a push to a point behind the canopy.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GentleRules {
    /// Points per tree.
    pub targets: Count,
    /// Longest trial.
    pub time: Quantity,
    /// Tolerance: largest distance to the point that counts as reached.
    pub tolerance: Quantity,
    /// Largest angle of the base from the named side, as seen from the point.
    pub side: Quantity,
    /// Heights of the points.
    pub height: Span,
    /// Distances from the trunk's axis.
    pub axis_distance: Span,
    /// Bearings about the trunk, relative to that of the robot's start.
    pub bearing: Span,
    /// Least distance from wood.
    pub clearance: Quantity,
    /// Length of the line outwards on which wood is counted.
    pub corridor_length: Quantity,
    /// Largest distance of counted wood from the line.
    pub corridor_radius: Quantity,
    /// Smallest number of wood segments near it.
    pub corridor_segments: Count,
    /// Largest number of draws for a point; after that the tree has no more points.
    pub draws: Count,
}
