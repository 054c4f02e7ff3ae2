//! Mechanical energy of a state.

use orchard_geometry::Vec3;

use crate::data::Data;
use crate::model::Model;

/// Energy by kind [J].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// Of links and point bodies.
    pub kinetic: f64,
    /// In gravity, zero at the world origin.
    pub gravitational: f64,
    /// In joint springs.
    pub joint_springs: f64,
    /// In tethers.
    pub tethers: f64,
    /// Of the constant forces on the anchors of tethered points, zero at the world origin.
    pub anchor_bias: f64,
}

impl Energy {
    /// The sum [J].
    pub fn total(&self) -> f64 {
        self.kinetic + self.gravitational + self.joint_springs + self.tethers + self.anchor_bias
    }
}

/// Energy of the state of the last kinematics.
pub fn energy(model: &Model, data: &Data, gravity: &Vec3) -> Energy {
    let _ = (model, data, gravity);
    todo!()
}
