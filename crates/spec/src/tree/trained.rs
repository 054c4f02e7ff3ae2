//! Trees trained flat along the wires of a row: V-trellis and upright fruiting offshoots.

use orchard_quantity::{Count, Quantity, Span};
use serde::{Deserialize, Serialize};

use super::CountSpan;

/// A shoot that is tied out along the wires and bears spurs: an arm of a V-trellis, an upright fruiting offshoot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShootSpec {
    /// Internodes of a shoot.
    pub internodes: CountSpan,
    /// Largest random bend of an internode; the node takes it back, so that the shoot keeps its course.
    pub wobble: Quantity,
    /// Downward bend an internode.
    pub droop: Span,
    /// Spurs at each of its nodes but the last.
    pub spurs: CountSpan,
    /// Roll from one spur to the next.
    pub divergence: Span,
    /// Angle between the shoot and a spur.
    pub spur_angle: Span,
    /// Length of a spur.
    pub spur_length: Span,
    /// Downward bend of a spur.
    pub spur_droop: Span,
}

/// Two leaders that lean into the alleys, each with arms in the plane of its wires.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VTrellisSpec {
    /// Height at which the trunk forks.
    pub fork_height: Quantity,
    /// Internodes of the trunk.
    pub trunk_internodes: Count,
    /// Angle between a leader and the horizontal.
    pub lean: Quantity,
    /// Length of a leader.
    pub leader_length: Quantity,
    /// Nodes of a leader; all but the last set an arm, in turn to the one and to the other side along the row.
    pub leader_nodes: CountSpan,
    /// Largest random bend of a leader's internode; the node takes it back.
    pub leader_wobble: Quantity,
    /// Angle between the leader and an arm, in the plane of the wires.
    pub arm_angle: Span,
    /// Angle between that plane and an arm, to either side.
    pub arm_stray: Quantity,
    /// Length of an arm.
    pub arm_length: Span,
    /// Chance that a node sets no arm.
    pub bud_abortion: Quantity,
    /// The arms.
    pub arm: ShootSpec,
    /// Most internodes of a tree; buds beyond it stay dormant.
    pub segments_max: Count,
}

/// A trunk laid down along the lowest wire, with upright shoots.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UprightsSpec {
    /// Height of the trunk's level part: the lowest wire's.
    pub trunk_height: Quantity,
    /// Internodes in which the trunk bends from upright to level.
    pub bend_internodes: Count,
    /// Length of that bend.
    pub bend_length: Quantity,
    /// Upright shoots, one at the end of each internode of the level trunk.
    pub uprights: CountSpan,
    /// Distance from one to the next.
    pub spacing: Span,
    /// Length of an upright, before it is topped.
    pub upright_length: Span,
    /// Length at which uprights are topped.
    pub topped_length: Quantity,
    /// Angle between an upright and the vertical, in the plane of the wires.
    pub upright_stray: Quantity,
    /// Chance that a node sets no upright; the last one sets one.
    pub bud_abortion: Quantity,
    /// The uprights.
    pub upright: ShootSpec,
    /// Most internodes of a tree; buds beyond it stay dormant.
    pub segments_max: Count,
}
