//! The grown tree as plain data.

use orchard_geometry::{Pose, Rotation, Vec3};
use serde::{Deserialize, Serialize};

/// A tree: internode segments in parent-before-child order, and the places where fruit and leaves may sit.
///
/// World frame: the trunk base is the origin, z up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Skeleton {
    /// Internodes; a parent always stands before its children.
    pub segments: Vec<Segment>,
    /// Places on outer spurs where a fruit may hang, in segment order.
    pub fruit_sites: Vec<FruitSite>,
    /// Leaf blades.
    pub leaves: Vec<LeafSite>,
    /// Branches too short to be segments. They move with their segment and bear no load of their own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub spurs: Vec<Spur>,
}

/// One internode: a straight piece of wood of constant radius that starts at its parent's tip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// Index of the parent; `None` for the first segment of the trunk.
    pub parent: Option<usize>,
    /// Base point \[m\], world.
    pub p_base_world: Vec3,
    /// Rotation of the segment's frame in the world; local +z is the heading.
    pub r_world_segment: Rotation,
    /// Length \[m\].
    pub length: f64,
    /// Radius \[m\].
    pub radius: f64,
    /// Branch order: 0 trunk and leader, 1 scaffold, 2 lateral, ...
    pub order: u8,
}

/// A place where a fruit's stem may be attached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FruitSite {
    /// Index of the segment that bears the site.
    pub segment: usize,
    /// Attachment point in the segment's frame \[m\].
    pub p_segment: Vec3,
    /// Horizontal distance from the trunk axis over the canopy's radius: 0 at the axis, 1 at the edge.
    pub outerness: f64,
}

/// A short branch, fixed to its segment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spur {
    /// Index of the segment on which it stands.
    pub segment: usize,
    /// Base on the bark, in the segment's frame \[m\].
    pub p_segment: Vec3,
    /// Unit vector from base to tip, in the segment's frame.
    pub heading_segment: Vec3,
    /// Length \[m\].
    pub length: f64,
    /// True if the spur bears an inflorescence.
    pub floral: bool,
}

/// One leaf blade, fixed to its segment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeafSite {
    /// Index of the segment on which it stands.
    pub segment: usize,
    /// Pose of the blade in the segment's frame: origin at the petiole, +x along the midrib, +z the upper face.
    pub x_segment_leaf: Pose,
    /// Length of the blade along the midrib \[m\].
    pub length: f64,
    /// Full width of the blade \[m\].
    pub width: f64,
    /// Size class: 0 small, 1 medium, 2 large.
    pub size_class: u8,
}

impl LeafSite {
    /// Area of the flat blade [m^2]: an ellipse of its length and width.
    pub fn area(&self) -> f64 {
        std::f64::consts::FRAC_PI_4 * self.length * self.width
    }
}

impl Segment {
    /// Tip point \[m\], world.
    pub fn p_tip_world(&self) -> Vec3 {
        self.p_base_world + self.heading() * self.length
    }

    /// Unit heading, world.
    pub fn heading(&self) -> Vec3 {
        self.r_world_segment * Vec3::z()
    }

    /// Pose of the segment's frame in the world.
    pub fn x_world_segment(&self) -> Pose {
        Pose::from_parts(self.p_base_world.into(), self.r_world_segment)
    }
}

impl Skeleton {
    /// Children of every segment, in index order.
    pub fn children(&self) -> Vec<Vec<usize>> {
        let mut children = vec![Vec::new(); self.segments.len()];
        for (i, segment) in self.segments.iter().enumerate() {
            if let Some(parent) = segment.parent {
                children[parent].push(i);
            }
        }
        children
    }
}
