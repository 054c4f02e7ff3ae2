//! Inverse dynamics by the recursive Newton-Euler algorithm (Featherstone 2008, chapter 5).

use orchard_geometry::Vec3;

use crate::data::Data;
use crate::model::Model;
use crate::spatial::{Twist, Wrench};

/// Torques that give the links the joint accelerations `acceleration` in gravity: `M a + c(q, v) + g(q)`
/// [N m, N], one for each degree of freedom.
///
/// Springs, damping, drag, external forces and point bodies are left out. Uses the last kinematics.
pub fn inverse_dynamics(model: &Model, data: &Data, acceleration: &[f64], gravity: &Vec3) -> Vec<f64> {
    let links = &data.kinematics.links;
    let added = link_twists(model, data, acceleration);
    let mut wrenches: Vec<Wrench> = std::iter::zip(model.bodies(), links)
        .zip(&added)
        .map(|((body, link), added)| {
            let a = link.bias_acceleration + *added;
            let omega = &link.velocity.angular;
            let a_com = a.linear_at(&link.r_com) + omega.cross(&omega.cross(&link.r_com));
            let torque_com = link.i_com * a.angular + omega.cross(&(link.i_com * *omega));
            Wrench { torque: torque_com, force: Vec3::zeros() }
                + Wrench::of_force_at((a_com - gravity) * body.inertia.mass, &link.r_com)
        })
        .collect();
    project_to_joints(model, data, &mut wrenches)
}

/// The joint-space inertia times a vector, `M x`. Point bodies are left out. Uses the last kinematics.
pub fn inertia_product(model: &Model, data: &Data, x: &[f64]) -> Vec<f64> {
    let mut wrenches: Vec<Wrench> = std::iter::zip(model.bodies(), &data.kinematics.links)
        .zip(link_twists(model, data, x))
        .map(|((body, link), twist)| {
            Wrench { torque: link.i_com * twist.angular, force: Vec3::zeros() }
                + Wrench::of_force_at(twist.linear_at(&link.r_com) * body.inertia.mass, &link.r_com)
        })
        .collect();
    project_to_joints(model, data, &mut wrenches)
}

/// Twists of the links at their origins by joint entries `x`: `J x`.
pub(crate) fn link_twists(model: &Model, data: &Data, x: &[f64]) -> Vec<Twist> {
    let links = &data.kinematics.links;
    let mut twists: Vec<Twist> = Vec::with_capacity(links.len());
    for id in model.body_ids() {
        let body = model.body(id);
        let parent = body.parent.map_or(Twist::ZERO, |parent| twists[parent.index()]);
        let mut twist = parent.shifted(&links[id.index()].r_parent);
        for (k, dof) in model.dofs(id).enumerate() {
            let part = data.kinematics.axes[dof] * x[dof];
            if k < body.joint.translations() {
                twist.linear += part;
            } else {
                twist.angular += part;
            }
        }
        twists.push(twist);
    }
    twists
}

/// Torques that hold the links against gravity at the last kinematics' pose [N m, N].
pub fn gravity_torque(model: &Model, data: &Data, gravity: &Vec3) -> Vec<f64> {
    let mut wrenches: Vec<Wrench> = std::iter::zip(model.bodies(), &data.kinematics.links)
        .map(|(body, link)| Wrench::of_force_at(gravity * -body.inertia.mass, &link.r_com))
        .collect();
    project_to_joints(model, data, &mut wrenches)
}

/// Passes the wrench that each link needs up to its parent and takes its component along each joint axis.
fn project_to_joints(model: &Model, data: &Data, wrenches: &mut [Wrench]) -> Vec<f64> {
    let mut torque = vec![0.0; model.nv()];
    for id in model.body_ids().rev() {
        let body = model.body(id);
        let wrench = wrenches[id.index()];
        for (k, dof) in model.dofs(id).enumerate() {
            let axis = data.kinematics.axes[dof];
            let along = if k < body.joint.translations() { wrench.force } else { wrench.torque };
            torque[dof] = axis.dot(&along);
        }
        if let Some(parent) = body.parent {
            wrenches[parent.index()] += wrench.shifted(&data.kinematics.links[id.index()].r_parent);
        }
    }
    torque
}
