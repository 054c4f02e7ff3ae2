//! Parts of a substep that both integrators use: the velocity change without contacts, and the update of the state.

use orchard_geometry::Vec3;

use crate::data::Data;
use crate::impulse;
use crate::integrate::move_joints;
use crate::model::Model;
use crate::solver::{self, LinearSolve, Solver};

/// Velocity change without contacts, left in `Data::change`; the factor stays for more right-hand sides.
pub(crate) fn free_change(
    model: &Model,
    data: &mut Data,
    h: f64,
    gravity: &Vec3,
    solver: Solver,
) -> LinearSolve {
    data.velocity_products.look_back(model, &data.q, &data.v, &mut data.kinematics, h);
    impulse::cap_tethers(model, data, h, gravity);
    solver::factor(solver, model, data, h);
    impulse::assemble(model, data, h, h, gravity);
    data.velocity_products.exchange(model, &data.kinematics, h, &mut data.impulse);
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
    move_joints(model, &mut data.q, &data.v, h);
    for (index, p_world) in data.point_p_world.iter_mut().enumerate() {
        *p_world += data.point_v_world[index] * h;
    }
}
