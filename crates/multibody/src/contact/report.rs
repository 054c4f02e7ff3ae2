//! Report of a contact.

use orchard_geometry::Vec3;
use serde::{Deserialize, Serialize};

use crate::model::ColliderId;

/// A contact of a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ContactReport {
    /// First collider.
    pub a: ColliderId,
    /// Second collider.
    pub b: ColliderId,
    /// Contact point \[m\], world, halfway between the surfaces.
    pub p_world: Vec3,
    /// Unit normal from b to a.
    pub n_world: Vec3,
    /// Distance of the surfaces at the start of the step \[m\]; negative while they overlap.
    pub gap: f64,
    /// Mean force on a over the step \[N\]; b feels the opposite.
    pub force_world: Vec3,
}
