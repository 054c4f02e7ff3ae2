//! Factor of the system matrix.

use orchard_geometry::Vec3;

use crate::model::{BodyId, Model};
use crate::spatial::{ArticulatedInertia, Wrench};

/// A point body's share of the factor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PointFactor {
    /// 1 / (m + h d + kappa) with the linearised air drag d [1/kg].
    pub inverse_mass: f64,
    /// Inertia that the tether adds to the point: kappa = h (c + h k) \[kg\]; 0 untethered.
    pub kappa: f64,
    /// Part of an impulse on the point that reaches its anchor, `kappa * inverse_mass`; 0 untethered or
    /// while the tether's reaction is capped.
    pub share: f64,
    /// From the origin of the anchor's link to the anchor \[m\].
    pub r_anchor: Vec3,
}

/// Factor of the system matrix.
#[derive(Debug, Clone)]
pub(crate) struct Factor {
    /// First degree of freedom that has neither inertia nor armature, as its link.
    pub singular: Option<BodyId>,
    /// Articulated inertia of each link's point bodies and eliminated children, at the link's origin.
    /// Zero between calls.
    pub(super) inertia: Vec<ArticulatedInertia>,
    /// Wrench that a unit impulse on each degree of freedom sends to the parent: G = U D^-1.
    pub g: Vec<Wrench>,
    /// D^-1 of each joint, row after row.
    pub d_inverse: Vec<f64>,
    /// Index of each joint's first entry in `d_inverse`.
    pub d_start: Vec<usize>,
    pub points: Vec<PointFactor>,
}

impl Factor {
    pub fn new(model: &Model) -> Factor {
        let mut d_start = vec![0];
        for (index, body) in model.bodies.iter().enumerate() {
            d_start.push(d_start[index] + body.joint.nv() * body.joint.nv());
        }
        let point = PointFactor { inverse_mass: 0.0, kappa: 0.0, share: 0.0, r_anchor: Vec3::zeros() };
        Factor {
            singular: None,
            inertia: vec![ArticulatedInertia::ZERO; model.bodies.len()],
            g: vec![Wrench::ZERO; model.nv()],
            d_inverse: vec![0.0; d_start[model.bodies.len()]],
            d_start,
            points: vec![point; model.points.len()],
        }
    }
}
