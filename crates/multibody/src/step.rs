//! One substep: kinematics, free solution, contacts, integration.

use nalgebra::Quaternion;
use orchard_geometry::{Rotation, Vec3};
use serde::{Deserialize, Serialize};

use crate::contact::{self, ContactPath, ContactReport};
use crate::data::Data;
use crate::kinematics::{forward_kinematics, rotation_by};
use crate::model::{JointKind, Model};
use crate::solver::{self, LinearSolve, Solver};
use crate::{impulse, midpoint, velocity_products};

/// Time integration scheme of a substep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// One linear solve, first order, damps like implicit Euler: the scheme of every benchmark figure.
    #[default]
    LinearlyImplicitEuler,
    /// The implicit midpoint rule, second order and without damping of its own, for validation. Contacts keep
    /// their first-order law.
    ImplicitMidpoint,
}

/// Numbers of a substep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepSettings {
    /// Length of the substep \[s\].
    pub h: f64,
    /// Gravity [m/s^2], world.
    pub gravity: Vec3,
    /// Contact dissipation time \[s\].
    pub contact_dissipation_time: f64,
    /// Gap below which a pair of colliders becomes a contact candidate \[m\]; at least `h` times the fastest
    /// approach keeps bodies from sinking in before they are seen.
    pub contact_margin: f64,
    /// The scheme.
    pub integrator: Integrator,
    /// Linear solver.
    pub solver: Solver,
    /// Algorithm that finds the contact impulses.
    pub contact_path: ContactPath,
}

/// Report of a substep. Reuse it: its buffers are kept.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Contacts that were candidates of the step; the force of an open one is zero.
    pub contacts: Vec<ContactReport>,
    /// The linear solve without contacts; under [`Integrator::ImplicitMidpoint`] all of its solves together.
    pub free: LinearSolve,
    /// Newton iterations of the contact solve; 0 without contacts.
    pub newton_iterations: usize,
    /// Conjugate-gradient iterations of all these Newton iterations; 0 on the direct path.
    pub cg_iterations: usize,
    /// Residual of the contact solve relative to its impulses.
    pub residual: f64,
    /// True if the contact solve met its tolerance.
    pub converged: bool,
    /// The linear solve that applies the contact impulses.
    pub response: LinearSolve,
}

/// Advances a world by one substep.
///
/// Velocities change first, then positions with the new velocities (with the mean of old and new under
/// [`Integrator::ImplicitMidpoint`]). Kinematics are brought up to date at the
/// start and at the end, so that the accessors of [`Data`] agree with `q` and `v` after the call; the cost is
/// paid once, since kinematics of an unchanged state are not computed again.
pub fn step(model: &Model, data: &mut Data, settings: &StepSettings, report: &mut StepReport) {
    forward_kinematics(model, data);
    free_spin(model, data, settings.h);
    match settings.integrator {
        Integrator::LinearlyImplicitEuler => {
            report.free = free_change(model, data, settings.h, &settings.gravity, settings.solver);
            contact::solve_contacts(model, data, settings, report);
            advance(model, data, settings.h);
        }
        Integrator::ImplicitMidpoint => midpoint::advance_by_midpoint(model, data, settings, report),
    }
    forward_kinematics(model, data);
}

/// Spin without contacts: lost implicitly off the tether, none on it.
fn free_spin(model: &Model, data: &mut Data, h: f64) {
    for index in 0..model.points.len() {
        if data.spins(model, index) {
            data.point_w_world[index] /= 1.0 + h * data.point_spin_damping[index];
        } else {
            data.point_w_world[index] = Vec3::zeros();
        }
    }
}

/// Velocity change without contacts, left in `Data::change`; the factor stays for more right-hand sides.
pub(crate) fn free_change(
    model: &Model,
    data: &mut Data,
    h: f64,
    gravity: &Vec3,
    solver: Solver,
) -> LinearSolve {
    velocity_products::look_back(model, data, h);
    impulse::cap_tethers(model, data, h, gravity);
    solver::factor(solver, model, data, h);
    impulse::assemble(model, data, h, h, gravity);
    velocity_products::exchange(model, data, h);
    solve_free(model, data, solver)
}

/// Solves the assembled right-hand side with the last factor into `Data::change`.
pub(crate) fn solve_free(model: &Model, data: &mut Data, solver: Solver) -> LinearSolve {
    let Data { kinematics, factor, linear, impulse, change, capped, .. } = data;
    let outcome = solver::solve(solver, model, (kinematics, factor), linear, impulse, change);
    // A capped tether pulls its point body towards the moving anchor, but the anchor does not feel it: the
    // factor leaves the anchor's motion out, and its free motion is added here.
    for (index, point) in model.points.iter().enumerate() {
        if let Some(tether) = &point.tether
            && capped[index]
        {
            let entry = &factor.points[index];
            let anchor = change.body[tether.body.index()].linear_at(&entry.r_anchor);
            change.point[index] += anchor * (entry.kappa * entry.inverse_mass);
        }
    }
    outcome
}

/// Adds `Data::change` to the velocities, then moves the positions with the new velocities.
pub(crate) fn advance(model: &Model, data: &mut Data, h: f64) {
    add_change(data);
    move_positions(model, data, h);
}

/// Adds `Data::change` to the velocities.
pub(crate) fn add_change(data: &mut Data) {
    for (v, dv) in data.v.iter_mut().zip(&data.change.dof) {
        *v += dv;
    }
    for (v, dv) in data.point_v_world.iter_mut().zip(&data.change.point) {
        *v += dv;
    }
}

/// Moves the positions for a time `h` with the velocities.
pub(crate) fn move_positions(model: &Model, data: &mut Data, h: f64) {
    move_joints(model, data, h);
    for (index, p_world) in data.point_p_world.iter_mut().enumerate() {
        *p_world += data.point_v_world[index] * h;
    }
}

/// Moves the joints for a time `h` with their velocities.
pub(crate) fn move_joints(model: &Model, data: &mut Data, h: f64) {
    for run in &model.runs {
        for (q, v) in data.q[run.qs()].iter_mut().zip(&data.v[run.dofs()]) {
            *q += h * v;
        }
    }
    for id in model.body_ids().filter(|id| model.body(*id).joint == JointKind::Free) {
        let (q, v) = (&mut data.q[model.qs(id)], &data.v[model.dofs(id)]);
        for (q, v) in q[..3].iter_mut().zip(v) {
            *q += h * v;
        }
        turn(&mut q[3..], &(Vec3::from_column_slice(&v[3..]) * h));
    }
}

/// Turns a quaternion (x, y, z, w) by a rotation vector in the frame that it maps to.
fn turn(quaternion: &mut [f64], by: &Vec3) {
    let old = Quaternion::new(quaternion[3], quaternion[0], quaternion[1], quaternion[2]);
    let new = rotation_by(by) * Rotation::new_normalize(old);
    quaternion.copy_from_slice(new.as_ref().coords.as_slice());
}
