//! Axis-aligned bounding boxes.

use crate::Vec3;

/// An axis-aligned bounding box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Lowest corner \[m\].
    pub min: Vec3,
    /// Highest corner \[m\].
    pub max: Vec3,
}

impl Aabb {
    /// True if two boxes share a point.
    #[inline]
    pub fn overlaps(&self, other: &Aabb) -> bool {
        (0..3).all(|k| self.min[k] <= other.max[k] && other.min[k] <= self.max[k])
    }

    /// Box enlarged on all sides by a margin \[m\].
    #[inline]
    pub fn grown(&self, by: f64) -> Aabb {
        let d = Vec3::repeat(by);
        Aabb { min: self.min - d, max: self.max + d }
    }

    /// Smallest box that contains both boxes.
    #[inline]
    pub fn union(&self, other: &Aabb) -> Aabb {
        Aabb { min: self.min.inf(&other.min), max: self.max.sup(&other.max) }
    }
}
