//! The implicit midpoint rule on top of the linearly implicit solve.
//!
//! With the state at the middle of the step as the unknown, q_m = q + h/2 v_m, the rule is
//!
//! `M(q_m) (v_m - v) = h/2 (tau - c(q_m, v_m) - K (q_m - q0) - (D + C) v_m)`, then `v' = 2 v_m - v`, `q' = q + h v_m`.
//!
//! The linearly implicit step over h/2 predicts v_m; each correction is a Newton step with the same matrix,
//! `M + h/2 (D + C) + h^2/4 K`, which leaves out only how M and c change within the step.

use orchard_geometry::Vec3;

use crate::contact;
use crate::data::{Data, forward_kinematics};
use crate::impulse;
use crate::model::Model;
use crate::rnea::{inertia_product, link_twists};
use crate::settings::{StepReport, StepSettings};
use crate::solver::{self, LinearSolve};
use crate::substep::{add_change, free_change, move_positions, solve_free};

/// Corrections end when none of them changes a velocity by more than this part of the fastest one.
const TOLERANCE: f64 = 1e-13;
/// Most corrections; each gains a power of h, and the first one already makes the step second order.
const MAX_CORRECTIONS: usize = 12;

/// The part of the state that a step changes, at its start.
struct Start {
    q: Vec<f64>,
    v: Vec<f64>,
    point_p_world: Vec<Vec3>,
    point_v_world: Vec<Vec3>,
}

impl Start {
    fn of(data: &Data) -> Start {
        Start {
            q: data.q.clone(),
            v: data.v.clone(),
            point_p_world: data.point_p_world.clone(),
            point_v_world: data.point_v_world.clone(),
        }
    }

    fn restore_positions(&self, data: &mut Data) {
        data.q.copy_from_slice(&self.q);
        data.point_p_world.copy_from_slice(&self.point_p_world);
    }

    fn restore_velocities(&self, data: &mut Data) {
        data.v.copy_from_slice(&self.v);
        data.point_v_world.copy_from_slice(&self.point_v_world);
    }
}

/// Advances velocities and positions; kinematics are those of the start, and stale afterwards.
pub(crate) fn advance_by_midpoint(
    model: &Model,
    data: &mut Data,
    settings: &StepSettings,
    report: &mut StepReport,
) {
    let (h, half) = (settings.h, 0.5 * settings.h);
    let start = Start::of(data);
    let mut free = free_change(model, data, half, &settings.gravity, settings.solver);
    for _ in 0..MAX_CORRECTIONS {
        let is_settled = !moves(data);
        add_change(data);
        if is_settled {
            break;
        }
        free = free.and(correction(model, data, &start, settings));
    }
    report.free = free;

    // Contacts act at the start's geometry on the velocity at the end: dv = 2 (v_m - v) + A(h/2)^-1 J^T p.
    for (dof, dv) in data.change.dof.iter_mut().enumerate() {
        *dv = 2.0 * (data.v[dof] - start.v[dof]);
    }
    for (index, dv) in data.change.point.iter_mut().enumerate() {
        *dv = (data.point_v_world[index] - start.point_v_world[index]) * 2.0;
    }
    start.restore_positions(data);
    start.restore_velocities(data);
    forward_kinematics(model, data);
    solver::factor(settings.solver, model, data, half);
    data.change.body = link_twists(model, data, &data.change.dof);
    contact::solve_contacts(model, data, settings, report);

    // Positions move with the mean velocity, v_m without contacts.
    add_change(data);
    let end = (data.v.clone(), data.point_v_world.clone());
    for (v, old) in data.v.iter_mut().zip(&start.v) {
        *v = 0.5 * (*v + old);
    }
    for (v, old) in data.point_v_world.iter_mut().zip(&start.point_v_world) {
        *v = (*v + old) * 0.5;
    }
    move_positions(model, data, h);
    (data.v, data.point_v_world) = end;
}

/// One Newton step on the rule from the present guess of v_m, into `Data::change`.
fn correction(model: &Model, data: &mut Data, start: &Start, settings: &StepSettings) -> LinearSolve {
    let half = 0.5 * settings.h;
    start.restore_positions(data);
    move_positions(model, data, half);
    forward_kinematics(model, data);
    solver::factor(settings.solver, model, data, half);
    impulse::assemble(model, data, half, 0.0, &settings.gravity);
    let gained: Vec<f64> = data.v.iter().zip(&start.v).map(|(now, old)| now - old).collect();
    let taken = inertia_product(model, data, &gained);
    for (impulse, taken) in data.impulse.dof.iter_mut().zip(taken) {
        *impulse -= taken;
    }
    for (index, point) in model.points.iter().enumerate() {
        let gained = data.point_v_world[index] - start.point_v_world[index];
        data.impulse.point[index] -= gained * point.mass;
    }
    solve_free(model, data, settings.solver)
}

/// True if `Data::change` exceeds the round-off of the velocities.
fn moves(data: &Data) -> bool {
    let dofs = data.v.iter().zip(&data.change.dof).map(|(v, dv)| (v.abs(), dv.abs()));
    let points = data.point_v_world.iter().zip(&data.change.point).map(|(v, dv)| (v.amax(), dv.amax()));
    let (fastest, largest) =
        dofs.chain(points).fold((0.0_f64, 0.0_f64), |(v, dv), (w, dw)| (v.max(w), dv.max(dw)));
    largest > TOLERANCE * fastest.max(largest)
}
