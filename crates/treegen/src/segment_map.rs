//! Moves fruit and leaf sites along when their segment changes shape.

use orchard_geometry::{Rotation, Vec3, math};

use crate::{Segment, fruit_sites::underside};

/// Map from points on a segment to the same points on its new shape, between the two segment frames. Along the wood it
/// stretches with the length; across the wood bark maps to bark; about the wood the underside maps to the new underside.
pub(crate) struct SegmentMap {
    roll: Rotation,
    stretch: f64,
    /// Radii before and after \[m\].
    from: f64,
    to: f64,
    /// Unit vector across the new shape to its lower side.
    underside: Vec3,
}

impl SegmentMap {
    pub fn new(from: &Segment, to: &Segment) -> Self {
        let (before, now) = (underside(from), underside(to));
        // Upright wood has no underside: no roll.
        let angle = math::atan2(before.cross(&now).z, before.dot(&now));
        Self {
            roll: Rotation::from_axis_angle(&Vec3::z_axis(), angle),
            stretch: to.length / from.length,
            from: from.radius,
            to: to.radius,
            underside: now,
        }
    }

    /// Maps a point on or outside the bark \[m\]. A point on the axis maps to the underside of the new shape.
    pub fn point(&self, p_segment: &Vec3) -> Vec3 {
        let across = Vec3::new(p_segment.x, p_segment.y, 0.0);
        let distance = across.norm();
        let across = if distance > 0.0 {
            let now = self.to + (distance - self.from) * self.stretch;
            self.roll * across * (now.max(0.0) / distance)
        } else {
            self.underside * self.to
        };
        across + Vec3::z() * (p_segment.z * self.stretch)
    }

    /// Maps a direction.
    pub fn direction(&self, v_segment: &Vec3) -> Vec3 {
        self.roll * v_segment
    }
}

/// Maps the attachment point of a stem from a segment's old shape to its new one, each in its segment frame \[m\].
pub fn map_point(p_segment: &Vec3, from: &Segment, to: &Segment) -> Vec3 {
    if from == to { *p_segment } else { SegmentMap::new(from, to).point(p_segment) }
}
