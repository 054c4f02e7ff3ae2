//! Points at which two surfaces are near each other.

use orchard_geometry::Vec3;

/// Contact points of a pair nearer than this are one \[m\].
pub(super) const SAME_POINT: f64 = 1e-6;

/// Two surfaces near each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Touch {
    /// Halfway between the surfaces.
    pub p_world: Vec3,
    /// Unit normal from b to a.
    pub n_world: Vec3,
    /// Distance; negative while they overlap.
    pub gap: f64,
}

impl Touch {
    /// From the point of b's surface, the normal from b to a, and the gap.
    pub fn from_b(p_b: Vec3, n_world: Vec3, gap: f64) -> Touch {
        Touch { p_world: p_b + n_world * (0.5 * gap), n_world, gap }
    }

    pub fn flipped(self) -> Touch {
        Touch { n_world: -self.n_world, ..self }
    }
}

/// Closest points of two segments (Ericson, Real-Time Collision Detection, 2005, section 5.1.9).
pub(super) fn closest_points_of_segments(a0: &Vec3, a1: &Vec3, b0: &Vec3, b1: &Vec3) -> (Vec3, Vec3) {
    let (along_a, along_b, between) = (a1 - a0, b1 - b0, a0 - b0);
    let (aa, bb, ab) = (along_a.norm_squared(), along_b.norm_squared(), along_a.dot(&along_b));
    let (ar, br) = (along_a.dot(&between), along_b.dot(&between));
    let clamped = |top: f64, bottom: f64| if bottom > 0.0 { (top / bottom).clamp(0.0, 1.0) } else { 0.0 };
    // The closest point of line a to line b (parallel lines: the start), then of segment b to it, then of a.
    let mut s = clamped(ab * br - ar * bb, aa * bb - ab * ab);
    let t = clamped(ab * s + br, bb);
    s = clamped(ab * t - ar, aa);
    (a0 + along_a * s, b0 + along_b * t)
}
