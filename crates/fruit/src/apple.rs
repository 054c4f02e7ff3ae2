//! An apple before anything moves.

use orchard_geometry::Vec3;

/// One apple on the unloaded tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Fruit {
    /// Segment that bears it.
    pub segment: usize,
    /// Anchor of the stem in the segment's frame \[m\].
    pub p_segment: Vec3,
    /// Centre of the hang point on the unloaded tree \[m\], world.
    pub p_hang_world: Vec3,
    /// Radius \[m\].
    pub radius: f64,
    /// Mass \[kg\].
    pub mass: f64,
    /// Direct pull that detaches it, f_detach \[N\].
    pub detach_force: f64,
}
