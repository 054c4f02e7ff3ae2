//! Articulated-body algorithm on the linearly implicit system: factor once, solve for many right-hand sides.
//!
//! The system matrix is `A = M + h (D + C) + h^2 K`: drag C scales each link's inertia, and damping D and
//! stiffness K add a diagonal in joint space, so Featherstone's recursion (Rigid Body Dynamics Algorithms,
//! 2008, chapter 7) factors it exactly in O(n). Tethered point bodies are eliminated as leaves.

mod joint;

use orchard_geometry::Vec3;

use crate::data::Data;
use crate::kinematics::Kinematics;
use crate::model::{BodyId, JointKind, Model};
use crate::spatial::{ArticulatedInertia, Twist, Wrench};
use joint::{factor_joint, for_joint, solve_joint_down, solve_joint_up};

/// A right-hand side: impulses.
#[derive(Debug, Clone, Default)]
pub struct Impulse {
    /// On each degree of freedom [N m s, N s].
    pub dof: Vec<f64>,
    /// On each link, at its origin, world axes [N m s, N s].
    pub body: Vec<Wrench>,
    /// On each point body [N s], world.
    pub point: Vec<Vec3>,
}

/// A solution: velocity changes.
#[derive(Debug, Clone, Default)]
pub struct Change {
    /// Of each degree of freedom [rad/s, m/s].
    pub dof: Vec<f64>,
    /// Of each link, at its origin, world axes [rad/s, m/s].
    pub body: Vec<Twist>,
    /// Of each point body [m/s], world.
    pub point: Vec<Vec3>,
}

impl Impulse {
    /// No impulse.
    pub fn new(model: &Model) -> Impulse {
        Impulse {
            dof: vec![0.0; model.nv()],
            body: vec![Wrench::ZERO; model.bodies.len()],
            point: vec![Vec3::zeros(); model.points.len()],
        }
    }

    /// Sets all to zero.
    pub fn clear(&mut self) {
        self.dof.fill(0.0);
        self.body.fill(Wrench::ZERO);
        self.point.fill(Vec3::zeros());
    }
}

impl Change {
    /// No change.
    pub fn new(model: &Model) -> Change {
        Change {
            dof: vec![0.0; model.nv()],
            body: vec![Twist::ZERO; model.bodies.len()],
            point: vec![Vec3::zeros(); model.points.len()],
        }
    }
}

/// A point body's share of the factor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PointFactor {
    /// 1 / (m + h d + kappa) with the linearised air drag d [1/kg].
    pub inverse_mass: f64,
    /// What the tether adds to the point's inertia: kappa = h (c + h k) [kg]; 0 untethered.
    pub kappa: f64,
    /// Part of an impulse on the point that reaches its anchor, `kappa * inverse_mass`; 0 untethered or
    /// while the tether's reaction is capped.
    pub share: f64,
    /// From the origin of the anchor's link to the anchor [m].
    pub r_anchor: Vec3,
}

/// Factor of the system matrix.
#[derive(Debug, Clone)]
pub(crate) struct Factor {
    /// First degree of freedom that has neither inertia nor armature, as its link.
    pub singular: Option<BodyId>,
    /// Articulated inertia of each link before its own joint is eliminated.
    inertia: Vec<ArticulatedInertia>,
    /// Wrench that a unit change of each degree of freedom takes: U = A S.
    u: Vec<Wrench>,
    /// Wrench that a unit impulse on each degree of freedom sends to the parent: G = U D^-1.
    pub g: Vec<Wrench>,
    /// D^-1 of each joint, row after row.
    pub d_inverse: Vec<f64>,
    /// Where each joint's D^-1 begins.
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
            u: vec![Wrench::ZERO; model.nv()],
            g: vec![Wrench::ZERO; model.nv()],
            d_inverse: vec![0.0; d_start[model.bodies.len()]],
            d_start,
            points: vec![point; model.points.len()],
        }
    }
}

/// Factors the system matrix for the substep `h` at the last kinematics, with the stiffness, damping, drag and
/// tethers that `data` holds. [`solve`] then works until the next call.
pub fn factor(model: &Model, data: &mut Data, h: f64) {
    let links = &data.kinematics.links;
    let factor = &mut data.factor;
    factor.singular = None;
    for (index, body) in model.bodies.iter().enumerate() {
        let link = &links[index];
        let mass = body.inertia.mass * (1.0 + h * data.linear_drag[index]);
        let i_com = link.i_com.scaled(1.0 + h * data.angular_drag[index]);
        factor.inertia[index] = ArticulatedInertia::of_rigid(mass, &link.r_com, i_com);
    }
    for (index, point) in model.points.iter().enumerate() {
        let drag = data.point_quadratic_drag[index] * data.point_v_world[index].norm();
        let mass = point.mass + h * drag;
        let tether = point.tether.as_ref().filter(|_| data.tethered[index]);
        let kappa = tether.map_or(0.0, |tether| h * (tether.damping + h * tether.stiffness));
        let inverse_mass = if data.point_carried[index] { 0.0 } else { 1.0 / (mass + kappa) };
        let mut entry = PointFactor { inverse_mass, kappa, share: 0.0, r_anchor: Vec3::zeros() };
        if let Some(tether) = tether {
            entry.r_anchor = links[tether.body.index()].x_world_body.rotation * tether.p_body;
            if !data.capped[index] {
                entry.share = kappa * inverse_mass;
                factor.inertia[tether.body.index()].add_point_mass(mass * entry.share, &entry.r_anchor);
            }
        }
        factor.points[index] = entry;
    }
    for (index, body) in model.bodies.iter().enumerate().rev() {
        let dofs = model.v_start[index]..model.v_start[index + 1];
        let mut inertia = factor.inertia[index];
        let spring = if body.joint == JointKind::Free { 0.0 } else { h * h };
        let is_regular = for_joint!(
            body.joint,
            factor_joint(
                &mut inertia,
                &data.kinematics.axes[dofs.clone()],
                |k| h * data.damping[dofs.start + k] + spring * data.stiffness[dofs.start + k],
                &mut factor.u[dofs.clone()],
                &mut factor.g[dofs.clone()],
                &mut factor.d_inverse[factor.d_start[index]..factor.d_start[index + 1]],
            )
        );
        if !is_regular {
            factor.singular = Some(BodyId(index as u32));
        }
        if let Some(parent) = body.parent {
            factor.inertia[parent.index()].add_shifted(&inertia, &links[index].r_parent);
        }
    }
}

/// Solves `A change = impulse` with the last [`factor`]. The body impulses are used as scratch: afterwards
/// they are spoilt.
pub fn solve(model: &Model, data: &Data, impulse: &mut Impulse, change: &mut Change) {
    solve_with(model, &data.kinematics, &data.factor, impulse, change);
}

pub(crate) fn solve_with(
    model: &Model,
    kinematics: &Kinematics,
    factor: &Factor,
    impulse: &mut Impulse,
    change: &mut Change,
) {
    for (index, point) in model.points.iter().enumerate() {
        let entry = &factor.points[index];
        if let Some(tether) = &point.tether
            && entry.share != 0.0
        {
            let reaction = Wrench::of_force_at(impulse.point[index] * entry.share, &entry.r_anchor);
            impulse.body[tether.body.index()] += reaction;
        }
    }
    for (index, body) in model.bodies.iter().enumerate().rev() {
        let dofs = model.v_start[index]..model.v_start[index + 1];
        let mut wrench = impulse.body[index];
        for_joint!(
            body.joint,
            solve_joint_up(
                &mut wrench,
                &kinematics.axes[dofs.clone()],
                &factor.g[dofs.clone()],
                &factor.d_inverse[factor.d_start[index]..factor.d_start[index + 1]],
                &impulse.dof[dofs.clone()],
                &mut change.dof[dofs],
            )
        );
        if let Some(parent) = body.parent {
            impulse.body[parent.index()] += wrench.shifted(&kinematics.links[index].r_parent);
        }
    }
    for (index, body) in model.bodies.iter().enumerate() {
        let dofs = model.v_start[index]..model.v_start[index + 1];
        let parent = body.parent.map_or(Twist::ZERO, |parent| change.body[parent.index()]);
        change.body[index] = for_joint!(
            body.joint,
            solve_joint_down(
                parent.shifted(&kinematics.links[index].r_parent),
                &kinematics.axes[dofs.clone()],
                &factor.g[dofs.clone()],
                &mut change.dof[dofs],
            )
        );
    }
    for (index, point) in model.points.iter().enumerate() {
        let entry = &factor.points[index];
        let mut total = impulse.point[index];
        if let Some(tether) = &point.tether
            && entry.share != 0.0
        {
            total += change.body[tether.body.index()].linear_at(&entry.r_anchor) * entry.kappa;
        }
        change.point[index] = total * entry.inverse_mass;
    }
}
