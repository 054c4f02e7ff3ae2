//! The distance of two placed shapes, for planners.

use orchard_geometry::{Pose, Shape, Vec3};

use super::narrow::{NarrowScratch, touches};
use super::touch::Touch;

/// The closest points of two surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Distance \[m\]; negative while the shapes overlap.
    pub distance: f64,
    /// Halfway between the closest points.
    pub p_world: Vec3,
    /// Unit normal from b to a. If both move, the distance changes with `n . (v_a - v_b)` at `p_world`.
    pub n_world: Vec3,
}

/// Finds distances by the narrow phase of the contacts; keeps its buffers.
#[derive(Debug, Clone, Default)]
pub struct GapFinder {
    scratch: NarrowScratch,
    touches: Vec<Touch>,
}

impl GapFinder {
    /// Returns the closest points of two placed shapes; `None` if they are not nearer than `within` \[m\].
    pub fn find(&mut self, a: (&Shape, &Pose), b: (&Shape, &Pose), within: f64) -> Option<Gap> {
        self.touches.clear();
        touches(a, b, within, &mut self.scratch, &mut self.touches);
        let closest = self.touches.iter().reduce(|best, one| if one.gap < best.gap { one } else { best })?;
        Some(Gap { distance: closest.gap, p_world: closest.p_world, n_world: closest.n_world })
    }
}
