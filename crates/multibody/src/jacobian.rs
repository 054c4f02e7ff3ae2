//! Geometric Jacobian of a body point.

use nalgebra::Matrix6xX;
use orchard_geometry::Vec3;

use crate::data::Data;
use crate::model::{BodyId, Model};

/// The matrix that maps v to the velocity of the material point of `body` now at `p_world`: rows 0-2 angular,
/// 3-5 linear, world axes. Uses the last kinematics.
pub fn geometric_jacobian(model: &Model, data: &Data, body: BodyId, p_world: &Vec3) -> Matrix6xX<f64> {
    let mut jacobian = Matrix6xX::zeros(model.nv());
    let mut next = Some(body);
    while let Some(id) = next {
        let joint_origin = data.x_world_body(id).translation.vector;
        for (k, dof) in model.dofs(id).enumerate() {
            let axis = data.kinematics.axes[dof];
            if k < model.body(id).joint.translations() {
                jacobian.fixed_view_mut::<3, 1>(3, dof).copy_from(&axis);
            } else {
                jacobian.fixed_view_mut::<3, 1>(0, dof).copy_from(&axis);
                jacobian.fixed_view_mut::<3, 1>(3, dof).copy_from(&axis.cross(&(p_world - joint_origin)));
            }
        }
        next = model.body(id).parent;
    }
    jacobian
}
