//! Trees trained flat along the wires of a row: V-trellis and upright fruiting offshoots.

use orchard_quantity::{Count, Quantity, Span};
use serde::{Deserialize, Serialize};

use super::CountSpan;

/// A shoot that is tied out along the wires and bears spurs: an arm of a V-trellis, an upright fruiting offshoot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShootSpec {
    /// Number of internodes of a shoot.
    pub internodes: CountSpan,
    /// Largest random bend of an internode; the node bends back, so that the shoot keeps its direction.
    pub wobble: Quantity,
    /// Downward bend an internode.
    pub droop: Span,
    /// Number of spurs at each node of the shoot but the last.
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
    /// Number of internodes of the trunk.
    pub trunk_internodes: Count,
    /// Angle between a leader and the horizontal.
    pub lean: Quantity,
    /// Length of a leader.
    pub leader_length: Quantity,
    /// Number of nodes of a leader; all but the last bear an arm, alternately to either side along the row.
    pub leader_nodes: CountSpan,
    /// Largest random bend of a leader's internode; the node bends back.
    pub leader_wobble: Quantity,
    /// Angle between the leader and an arm, in the plane of the wires.
    pub arm_angle: Span,
    /// Largest angle between the plane of the wires and an arm, to either side.
    pub arm_stray: Quantity,
    /// Length of an arm.
    pub arm_length: Span,
    /// Chance that a node bears no arm.
    pub bud_abortion: Quantity,
    /// Parameters of the arms.
    pub arm: ShootSpec,
    /// Most internodes of a tree; buds beyond it stay dormant.
    pub segments_max: Count,
}

/// A trunk laid down along the lowest wire, with upright shoots.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UprightsSpec {
    /// Height of the trunk's level part, at the lowest wire.
    pub trunk_height: Quantity,
    /// Number of internodes in which the trunk bends from upright to level.
    pub bend_internodes: Count,
    /// Length of that bend.
    pub bend_length: Quantity,
    /// Number of upright shoots, one at the end of each internode of the level trunk.
    pub uprights: CountSpan,
    /// Distance from one upright to the next.
    pub spacing: Span,
    /// Length of an upright, before it is topped.
    pub upright_length: Span,
    /// Length at which uprights are topped.
    pub topped_length: Quantity,
    /// Angle between an upright and the vertical, in the plane of the wires.
    pub upright_stray: Quantity,
    /// Chance that a node bears no upright; the last node always bears one.
    pub bud_abortion: Quantity,
    /// Parameters of the uprights.
    pub upright: ShootSpec,
    /// Most internodes of a tree; buds beyond it stay dormant.
    pub segments_max: Count,
}
