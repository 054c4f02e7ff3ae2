//! Posts and wires of a row of trees.

use orchard_quantity::{Count, Quantity, Span};
use serde::{Deserialize, Serialize};

/// Support of one row, along the world's x axis through the tree: posts, and wires from the first to the last of them.
///
/// The posts stand upright up to `fork_height`, and from there in one upright plane or in two that lean into the
/// alleys on both sides. The wires run outside of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenerySpec {
    /// Number of posts; the tree stands in the middle of the row, between two posts.
    pub posts: Count,
    /// Distance from post to post.
    pub post_spacing: Quantity,
    /// Radius of a post.
    pub post_radius: Quantity,
    /// Height of a post above the ground.
    pub post_height: Quantity,
    /// Angle between the planes of the wires and the horizontal; 90 deg is one plane.
    pub lean: Quantity,
    /// Height at which leaning planes meet.
    pub fork_height: Quantity,
    /// Number of wires in a plane.
    pub wires: Count,
    /// Height of the lowest wire.
    pub lowest_wire: Quantity,
    /// Distance from wire to wire in their plane.
    pub wire_spacing: Quantity,
    /// Distance of a wire from the plane of the posts' axes, towards the alley: brackets hold it clear of the trunk.
    pub wire_offset: Quantity,
    /// Radius of a wire.
    pub wire_radius: Quantity,
    /// Friction coefficient.
    pub friction: Quantity,
    /// Stiffness of the surface in a contact.
    pub contact_stiffness: Quantity,
    /// Bearing of the robot's start from the alley's middle, on either side of the row.
    pub start_bearing: Span,
}
