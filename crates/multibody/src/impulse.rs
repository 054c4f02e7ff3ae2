//! Right-hand side of the step: impulses of all forces at the start of the substep.

use nalgebra::Vector3;
use orchard_geometry::Vec3;

use crate::data::Data;
use crate::lanes::{Packed, Pair, Real, each};
use crate::model::{JointKind, Model, Tether};
use crate::rod::Deflection;
use crate::schedule::Slot;
use crate::spatial::{Twist, Wrench};
use crate::symmetric::Symmetric3;

/// Impulse of a tether on its point body if neither end's velocity changed [N s]: `h f(x + lead v, v)`.
fn tether_impulse(data: &Data, tether: &Tether, index: usize, h: f64, lead: f64) -> Vec3 {
    let link = &data.kinematics.links[tether.body.index()];
    let r_anchor = link.turned(&tether.p_body);
    let x = data.point_p_world[index] - (link.origin() + r_anchor + tether.offset_world);
    let v = data.point_v_world[index] - link.velocity.linear_at(&r_anchor);
    -(x * tether.stiffness + v * (tether.damping + lead * tether.stiffness)) * h
}

/// Impulse of weight, external and paired force and air drag on a point body [N s].
fn point_impulse(model: &Model, data: &Data, index: usize, h: f64, gravity: &Vec3) -> Vec3 {
    let v = data.point_v_world[index];
    let drag = data.point_quadratic_drag[index] * v.norm();
    let force = data.point_force_world[index] + data.point_paired_force_world[index];
    (gravity * model.points[index].mass + force - v * drag) * h
}

/// Marks the tethers whose reaction exceeds its cap in this step.
///
/// The reaction is predicted with the anchor at its present velocity and the point body free to respond:
/// in static equilibrium it is exact. Like contacts, forces that a body at the point bears in turn are left out.
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

/// Predicted force of a point body and its bias on the anchor \[N\].
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
    let impulse = point_impulse(model, data, index, h, gravity) - data.point_paired_force_world[index] * h;
    let change = (impulse + pull) / (mass + kappa);
    data.anchor_bias_world[index] - (pull - change * kappa) / h
}

/// Impulse over `h` of weight, external force, velocity products and drag on some links, at their origins.
#[inline(always)]
fn link_impulse<S: Real>(links: &[usize], model: &Model, data: &Data, h: f64, gravity: &Vec3) -> Wrench<S> {
    let poses = each(links, |link| &data.kinematics.links[link]);
    let velocity = Twist::<S>::pack(|l| poses[l].velocity);
    let bias = Twist::<S>::pack(|l| poses[l].bias_acceleration);
    let (omega, r) = (&velocity.angular, &Vector3::pack(|l| poses[l].r_com));
    let v_com = velocity.linear_at(r);
    let a_com = bias.linear_at(r) + omega.cross(&omega.cross(r));
    let mass = S::pack(|l| model.bodies[links[l]].inertia.mass);
    let drag = v_com * S::pack(|l| data.linear_drag[links[l]]);
    let force = (Vector3::pack(|_| *gravity) - a_com - drag) * mass
        + Vector3::pack(|l| data.body_force_world[links[l]]);
    let i_com = Symmetric3::<S>::pack(|l| poses[l].i_com);
    let spin = i_com * *omega;
    let torque_com = Vector3::pack(|l| data.body_torque_world[links[l]])
        - i_com * bias.angular
        - omega.cross(&spin)
        - spin * S::pack(|l| data.angular_drag[links[l]]);
    Wrench { torque: torque_com + r.cross(&force), force }.scaled(S::splat(h))
}

/// Fills `Data::impulse` with the impulses over `h` of all forces at the last kinematics, springs where they
/// will be after `lead`: h is the right-hand side of the linearly implicit step, 0 gives the present forces.
pub(crate) fn assemble(model: &Model, data: &mut Data, h: f64, lead: f64, gravity: &Vec3) {
    let mut impulse = std::mem::take(&mut data.impulse);
    for slot in &model.schedule {
        match slot {
            Slot::One([index]) => {
                impulse.body[*index] = link_impulse::<f64>(&[*index], model, data, h, gravity)
            }
            Slot::Two(links) => {
                let both = link_impulse::<Pair>(links, model, data, h, gravity);
                [impulse.body[links[0]], impulse.body[links[1]]] = [both.lane(0), both.lane(1)];
            }
        }
    }
    assemble_joints(model, data, h, lead, &mut impulse.dof);
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

/// Impulses over `h` of drives, dampers and springs on the degrees of freedom.
fn assemble_joints(model: &Model, data: &Data, h: f64, lead: f64, impulse: &mut [f64]) {
    let dampers = data.torque.iter().zip(&data.damping).zip(&data.v);
    for (impulse, ((torque, damping), v)) in impulse.iter_mut().zip(dampers) {
        *impulse = h * (torque - damping * v);
    }
    for run in &model.runs {
        let stretch = data.q[run.qs()].iter().zip(&data.rest[run.dofs()]).zip(&data.v[run.dofs()]);
        let springs = data.stiffness[run.dofs()].iter().zip(stretch);
        for (impulse, (stiffness, ((q, rest), v))) in impulse[run.dofs()].iter_mut().zip(springs) {
            *impulse -= h * (stiffness * (q - rest + lead * v));
        }
    }
    for &id in model.turning.iter().filter(|id| model.body(**id).joint == JointKind::Ball) {
        let dofs = model.dofs(id);
        let stiffness = &data.stiffness[dofs.clone()];
        let torque = Deflection::of(&data.q[model.qs(id)]).torque(stiffness[0], stiffness[2]);
        for (k, dof) in dofs.enumerate() {
            impulse[dof] += h * (torque[k] - lead * stiffness[k] * data.v[dof]);
        }
    }
}
