//! Velocity products of fast links, computed from the change of momentum since the last pose.
//!
//! The step takes the velocity products `c(q, v)` at its start, explicitly. Where a link turns far in a substep,
//! that adds energy without end (`docs/computation/dynamics.md`, "Fast turns"). There `h c` is replaced by
//!
//! `Jᵀ(q) [momentum(J(q) v) - momentum(J(q - h v) v)]`,
//!
//! the backward difference of the Jacobian along the motion in place of its derivative. The step then projects the
//! velocities that all links had at the last pose on those that the joints allow at this one, which cannot add energy.

use nalgebra::Matrix3;
use orchard_geometry::Vec3;

use crate::aba::vectors::Impulse;
use crate::integrate::move_joints;
use crate::kinematics::{Kinematics, Link};
use crate::model::Model;
use crate::spatial::{Twist, Wrench};

/// Turn of a link within a substep \[rad\] up to which velocity products are explicit.
pub const SLOW_TURN: f64 = 0.1;
/// Turn of a link within a substep \[rad\] from which the change of momentum replaces them.
const FAST_TURN: f64 = 0.2;

/// Scratch: velocities of the links at the last pose.
#[derive(Debug, Clone, Default)]
pub(crate) struct VelocityProducts {
    /// Share of the velocity products that is replaced, 0 to 1; at 0 the other fields are invalid.
    share: f64,
    /// Joint coordinates of the last pose.
    q: Vec<f64>,
    /// Velocity of each link's centre of mass, world axes, and its angular velocity, the link's axes.
    links: Vec<Twist>,
}

impl VelocityProducts {
    pub fn new(model: &Model) -> VelocityProducts {
        VelocityProducts {
            share: 0.0,
            q: vec![0.0; model.nq()],
            links: vec![Twist::ZERO; model.bodies.len()],
        }
    }

    /// Sets the share of the velocity products to replace in a substep of length `h`, and, if it is not 0, computes the
    /// velocities at the last pose. Kinematics are valid before and after.
    pub fn look_back(&mut self, model: &Model, q: &[f64], v: &[f64], kinematics: &mut Kinematics, h: f64) {
        let turn = h * fastest_turn(kinematics);
        self.share = ((turn - SLOW_TURN) / (FAST_TURN - SLOW_TURN)).clamp(0.0, 1.0);
        if self.share == 0.0 {
            return;
        }
        self.q.copy_from_slice(q);
        move_joints(model, &mut self.q, v, -h);
        kinematics.update(model, &self.q, v);
        for (before, link) in self.links.iter_mut().zip(&kinematics.links) {
            before.angular = in_link(link, &link.velocity.angular);
            before.linear = link.velocity.linear_at(&link.r_com);
        }
        kinematics.update(model, q, v);
    }

    /// Replaces that share of the velocity products in `impulse`, the impulses over `h` at the last kinematics.
    pub fn exchange(&self, model: &Model, kinematics: &Kinematics, h: f64, impulse: &mut Impulse) {
        let share = self.share;
        if share == 0.0 {
            return;
        }
        let links = kinematics.links.iter().zip(&self.links).zip(&model.bodies);
        for (impulse, ((link, before), body)) in impulse.body.iter_mut().zip(links) {
            let (omega, r) = (&link.velocity.angular, &link.r_com);
            let bias = &link.bias_acceleration;
            let a_com = bias.linear_at(r) + omega.cross(&omega.cross(r));
            let explicit_torque = link.i_com * bias.angular + omega.cross(&(link.i_com * *omega));
            let lost = link.velocity.linear_at(r) - before.linear;
            let turned = link.turned(&torque_free(&body.inertia.i_com, &before.angular, h));
            let force = (a_com * h - lost) * body.inertia.mass;
            let torque = explicit_torque * h - link.i_com * (*omega - turned);
            *impulse += Wrench { torque: torque + r.cross(&force), force }.scaled(share);
        }
    }
}

/// Largest rate at which a link turns [rad/s].
pub(crate) fn fastest_turn(kinematics: &Kinematics) -> f64 {
    let squares = kinematics.links.iter().map(|link| link.velocity.angular.norm_squared());
    squares.fold(0.0_f64, f64::max).sqrt()
}

/// A world vector in the link's axes.
fn in_link(link: &Link, vector: &Vec3) -> Vec3 {
    Vec3::from_fn(|axis, _| link.turn[axis].dot(vector))
}

/// Angular velocity of a body on its own after `h`, in its own axes: `I (w' - w) = h/2 (I w) x (w' + w)`, which
/// keeps `wᵀ I w`.
fn torque_free(i_com: &Matrix3<f64>, omega: &Vec3, h: f64) -> Vec3 {
    let gyration = (i_com * omega).cross_matrix() * (0.5 * h);
    let matrix = i_com - gyration;
    matrix.try_inverse().map_or(*omega, |inverse| inverse * ((i_com + gyration) * omega))
}
