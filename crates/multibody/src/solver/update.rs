//! The system matrix A of a world.

use super::system::{LinkRow, PointRow, System};
use crate::data::Data;
use crate::model::{JointKind, Model};
use crate::spatial::{Twist, Wrench};

impl System {
    /// Takes A over the substep `h` from the last kinematics and the inputs; tethers as the last factor saw them.
    pub fn update(&mut self, model: &Model, data: &Data, h: f64) {
        self.links.clear();
        self.armature.clear();
        for (index, body) in model.bodies.iter().enumerate() {
            let i_com = data.kinematics.links[index].i_com;
            self.links.push(LinkRow {
                mass: body.inertia.mass * (1.0 + h * data.linear_drag[index]),
                i_com: i_com.scaled(1.0 + h * data.angular_drag[index]),
            });
            let spring = if body.joint == JointKind::Free { 0.0 } else { h * h };
            self.armature.extend(
                (model.v_start[index]..model.v_start[index + 1])
                    .map(|dof| h * data.damping[dof] + spring * data.stiffness[dof]),
            );
        }
        self.points.clear();
        for (index, point) in model.points.iter().enumerate() {
            let drag = data.point_quadratic_drag[index] * data.point_v_world[index].norm();
            let factor = &data.factor.points[index];
            let tether = point.tether.as_ref().filter(|_| factor.share != 0.0);
            self.points.push(PointRow {
                mass: point.mass + h * drag,
                kappa: factor.kappa,
                anchor: tether.map(|tether| (tether.body.index(), factor.r_anchor)),
                is_carried: data.point_carried[index],
            });
        }
        self.twists.resize(model.bodies.len(), Twist::ZERO);
        self.wrenches.resize(model.bodies.len(), Wrench::ZERO);
        self.invert_diagonal(model, &data.kinematics);
    }
}
