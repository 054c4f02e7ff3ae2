//! Geometric Jacobian of a body point.

use nalgebra::Matrix6xX;
use orchard_geometry::Vec3;

use crate::data::Data;
use crate::model::{BodyId, Model};

/// The matrix that maps v to the velocity of the material point of `body` now at `p_world`: rows 0-2 angular,
/// 3-5 linear, world axes. Uses the last kinematics.
pub fn geometric_jacobian(model: &Model, data: &Data, body: BodyId, p_world: &Vec3) -> Matrix6xX<f64> {
    let _ = (model, data, body, p_world);
    todo!()
}
