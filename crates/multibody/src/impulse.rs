//! Right-hand side of the step: impulses of all forces at the start of the substep.

use orchard_geometry::Vec3;

use crate::data::Data;
use crate::model::{JointKind, Model, Tether};
use crate::spatial::Wrench;

/// Impulse of a tether on its point body if neither end's velocity changed [N s]: `h f(x + lead v, v)`.
fn tether_impulse(data: &Data, tether: &Tether, index: usize, h: f64, lead: f64) -> Vec3 {
    let link = &data.kinematics.links[tether.body.index()];
    let r_anchor = link.x_world_body.rotation * tether.p_body;
    let x = data.point_p_world[index] - (link.origin() + r_anchor + tether.offset_world);
    let v = data.point_v_world[index] - link.velocity.linear_at(&r_anchor);
    -(x * tether.stiffness + v * (tether.damping + lead * tether.stiffness)) * h
}

/// Impulse of weight, external force and air drag on a point body [N s].
fn point_impulse(model: &Model, data: &Data, index: usize, h: f64, gravity: &Vec3) -> Vec3 {
    let v = data.point_v_world[index];
    let drag = data.point_quadratic_drag[index] * v.norm();
    (gravity * model.points[index].mass + data.point_force_world[index] - v * drag) * h
}

/// Decides which tethers pass their reaction cap in this step.
///
/// The reaction is predicted with the anchor going on at its velocity and the point body free to respond:
/// in static equilibrium it is exact.
pub(crate) fn cap_tethers(model: &Model, data: &mut Data, h: f64, gravity: &Vec3) {
    for (index, point) in model.points.iter().enumerate() {
        data.capped[index] = match &point.tether {
            Some(tether) if data.tethered[index] && data.reaction_cap[index].is_finite() => {
                predicted_reaction(model, data, tether, index, h, gravity).norm() > data.reaction_cap[index]
            }
            _ => false,
        };
    }
}

/// Predicted force of a point body and its bias on the anchor [N].
fn predicted_reaction(
    model: &Model,
    data: &Data,
    tether: &Tether,
    index: usize,
    h: f64,
    gravity: &Vec3,
) -> Vec3 {
    let drag = data.point_quadratic_drag[index] * data.point_v_world[index].norm();
    let mass = model.points[index].mass + h * drag;
    let kappa = h * (tether.damping + h * tether.stiffness);
    let pull = tether_impulse(data, tether, index, h, h);
    let change = (point_impulse(model, data, index, h, gravity) + pull) / (mass + kappa);
    data.anchor_bias_world[index] - (pull - change * kappa) / h
}

/// Fills `Data::impulse` with the impulses over `h` of all forces at the last kinematics, springs where they
/// will be after `lead`: h is the right-hand side of the linearly implicit step, 0 gives the forces as they are.
pub(crate) fn assemble(model: &Model, data: &mut Data, h: f64, lead: f64, gravity: &Vec3) {
    let mut impulse = std::mem::take(&mut data.impulse);
    for (index, body) in model.bodies.iter().enumerate() {
        let link = &data.kinematics.links[index];
        let omega = &link.velocity.angular;
        let (mass, r) = (body.inertia.mass, &link.r_com);
        let v_com = link.velocity.linear_at(r);
        let a_com = link.bias_acceleration.linear_at(r) + omega.cross(&omega.cross(r));
        let force = (gravity - a_com - v_com * data.linear_drag[index]) * mass + data.body_force_world[index];
        let spin = link.i_com * *omega;
        let torque_com = data.body_torque_world[index]
            - link.i_com * link.bias_acceleration.angular
            - omega.cross(&spin)
            - spin * data.angular_drag[index];
        impulse.body[index] =
            (Wrench { torque: torque_com, force: Vec3::zeros() } + Wrench::of_force_at(force, r)).scaled(h);
        let q_start = model.q_start[index];
        for (k, dof) in (model.v_start[index]..model.v_start[index + 1]).enumerate() {
            let mut torque = data.torque[dof] - data.damping[dof] * data.v[dof];
            if body.joint != JointKind::Free {
                let stretch = data.q[q_start + k] - data.rest[dof] + lead * data.v[dof];
                torque -= data.stiffness[dof] * stretch;
            }
            impulse.dof[dof] = h * torque;
        }
    }
    for (index, point) in model.points.iter().enumerate() {
        impulse.point[index] = point_impulse(model, data, index, h, gravity);
        let Some(tether) = point.tether.as_ref().filter(|_| data.tethered[index]) else { continue };
        let pull = tether_impulse(data, tether, index, h, lead);
        impulse.point[index] += pull;
        let reaction = if data.capped[index] {
            let predicted = predicted_reaction(model, data, tether, index, h, gravity);
            predicted * (h * data.reaction_cap[index] / predicted.norm())
        } else {
            data.anchor_bias_world[index] * h - pull
        };
        let r_anchor = data.factor.points[index].r_anchor;
        impulse.body[tether.body.index()] += Wrench::of_force_at(reaction, &r_anchor);
    }
    data.impulse = impulse;
}
