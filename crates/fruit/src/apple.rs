//! An apple before anything moves.

use orchard_geometry::Vec3;
use orchard_spec::fruit::FruitSpec;

/// One apple on the unloaded tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Fruit {
    /// Segment that bears it.
    pub segment: usize,
    /// Spur on which its cluster stands: index among the tree's fruit sites.
    pub site: usize,
    /// Anchor of the stem in the segment's frame \[m\].
    pub p_segment: Vec3,
    /// Centre of the hang point on the unloaded tree \[m\], world.
    pub p_hang_world: Vec3,
    /// Radius \[m\].
    pub radius: f64,
    /// Mass \[kg\].
    pub mass: f64,
    /// Direct pull that detaches it, f_detach \[N\]; along the axis of its zone where it hangs on a stem that bends.
    pub detach_force: f64,
    /// Torque that twists it off [N m]; infinite on a tether.
    pub twist_strength: f64,
    /// Pull that tears its spur off \[N\]; infinite on a tether.
    pub spur_strength: f64,
}

impl Fruit {
    /// Rotational inertia of a homogeneous ball about any axis through its centre [kg m^2].
    pub fn spin_inertia(&self) -> f64 {
        0.4 * self.mass * self.radius * self.radius
    }
}

/// Centre of a fruit that hangs straight down from its stem's anchor \[m\], world.
pub(crate) fn hang_point(spec: &FruitSpec, p_anchor_world: &Vec3, radius: f64) -> Vec3 {
    p_anchor_world - Vec3::new(0.0, 0.0, spec.stem_length.si() + radius)
}
