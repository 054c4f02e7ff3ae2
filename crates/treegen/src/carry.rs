//! What stands on wood goes with it when the wood changes its form.

use orchard_geometry::{Rotation, Vec3, math};

use crate::{Segment, fruit_sites::underside};

/// From one form of a segment to another, between their frames: along the wood everything is stretched with it, across
/// it the bark stays the bark, and about it what was on the underside comes to the underside.
pub(crate) struct Carrier {
    roll: Rotation,
    stretch: f64,
    /// Radii [m].
    from: f64,
    to: f64,
    /// Across the wood to its lower side as it is now.
    underside: Vec3,
}

impl Carrier {
    pub fn new(from: &Segment, to: &Segment) -> Self {
        let (before, now) = (underside(from), underside(to));
        // Upright wood has no underside, and nothing rolls.
        let angle = math::atan2(before.cross(&now).z, before.dot(&now));
        Self {
            roll: Rotation::from_axis_angle(&Vec3::z_axis(), angle),
            stretch: to.length / from.length,
            from: from.radius,
            to: to.radius,
            underside: now,
        }
    }

    /// A point on or outside the bark [m]. One on the axis of upright wood, which has no underside, comes to the underside that
    /// the wood may have now.
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

    /// A direction.
    pub fn direction(&self, v_segment: &Vec3) -> Vec3 {
        self.roll * v_segment
    }
}

/// Where a stem on the bark of a segment is attached after the wood has changed from one form to another. Segment frames [m].
pub fn carried_to(p_segment: &Vec3, from: &Segment, to: &Segment) -> Vec3 {
    if from == to { *p_segment } else { Carrier::new(from, to).point(p_segment) }
}
