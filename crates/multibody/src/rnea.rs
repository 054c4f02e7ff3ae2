//! Inverse dynamics by the recursive Newton-Euler algorithm.

use orchard_geometry::Vec3;

use crate::data::Data;
use crate::model::Model;

/// Torques that give the links the joint accelerations `acceleration` in gravity: `M a + c(q, v) + g(q)`
/// [N m, N], one for each degree of freedom. Springs, damping, drag, external forces and point bodies are
/// left out. Uses the last kinematics.
pub fn inverse_dynamics(model: &Model, data: &Data, acceleration: &[f64], gravity: &Vec3) -> Vec<f64> {
    let _ = (model, data, acceleration, gravity);
    todo!()
}

/// Torques that hold the links against gravity at the last kinematics' pose [N m, N].
pub fn gravity_torque(model: &Model, data: &Data, gravity: &Vec3) -> Vec<f64> {
    let _ = (model, data, gravity);
    todo!()
}
