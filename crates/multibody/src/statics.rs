//! Static equilibrium by implicit steps from rest.
//!
//! A step of length h from rest moves by `(M / h^2 + K)^-1 f`, f the exact unbalanced force. With h so large
//! that inertia vanishes it is a Newton step on the statics that leaves the geometric stiffness out: it
//! converges at the ratio of geometric to elastic stiffness. Where gravity is stiffer than the spring (a limp
//! twig hanging down) that overshoots; h is then cut until `M / h^2` carries the geometric stiffness.

use orchard_geometry::Vec3;

use crate::data::{Data, forward_kinematics};
use crate::model::{JointKind, Model};
use crate::solver::Solver;
use crate::substep::{advance, free_change};

/// Longest step \[s\]: inertia is 1e-8 of the stiffness of a 1 Hz mode.
const LONGEST_STEP: f64 = 1e3;
/// First step after an overshoot \[s\]: a pendulum of a metre.
const FIRST_CUT: f64 = 0.3;
/// A step is cut by this when it turns back on the one before, and lengthened by the square root of the
/// inverse when it does not.
const CUT: f64 = 0.5;
/// Damping that holds a degree of freedom still [N m s/rad].
const HOLDING_DAMPING: f64 = 1e30;
/// A step is shortened so that no joint coordinate moves further [rad or m].
const LARGEST_MOVE: f64 = 0.3;
/// Iterations after which every further turn shortens the longest step, by this factor, down to the shortest one \[s\]: weak wood that a long
/// step makes overshoot again and again creeps to its rest instead.
const PATIENCE: usize = 500;
const SHORTENED: f64 = 0.7;
const SHORTEST_STEP: f64 = 0.05;
/// Iterations before the search is given up.
const MAX_ITERATIONS: usize = 6000;
/// Largest move of the last of them at which the state counts as at rest all the same [rad or m]: near buckling a tree creeps towards its rest by
/// a thousandth of the way in each iteration, and is then within 1e-4 of it.
const NEARLY: f64 = 1e-7;

/// Failure to find an equilibrium.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StaticsError {
    /// The iterations ran out, or the state diverged (a buckling tree).
    #[error("no equilibrium after {iterations} iterations: the last one still moved by {step:e}")]
    NotConverged {
        /// Iterations made.
        iterations: usize,
        /// Largest change of a coordinate in the last one [rad or m].
        step: f64,
    },
}

/// Moves the sprung joints and the tethered point bodies to static equilibrium under gravity and the inputs,
/// at rest; the other degrees of freedom are held, and contacts are left out. Converged when no coordinate
/// moves by more than `tolerance` [rad or m] in an iteration, or by more than 1e-7 in the last of 6,000. Returns the number of iterations.
///
/// # Errors
/// [`StaticsError::NotConverged`]; the state is then the last iterate.
pub fn equilibrium(
    model: &Model,
    data: &mut Data,
    gravity: &Vec3,
    tolerance: f64,
) -> Result<usize, StaticsError> {
    let mut held_dofs = Vec::new();
    for id in model.body_ids() {
        let is_free = model.body(id).joint == JointKind::Free;
        held_dofs.extend(model.dofs(id).filter(|&dof| is_free || data.stiffness[dof] <= 0.0));
    }
    let hangs = |index: &usize| {
        data.tethered[*index] && model.points[*index].tether.as_ref().is_some_and(|t| t.stiffness > 0.0)
    };
    let held_points: Vec<usize> = (0..model.points.len()).filter(|index| !hangs(index)).collect();

    let damping = std::mem::replace(&mut data.damping, vec![0.0; model.nv()]);
    for &dof in &held_dofs {
        data.damping[dof] = HOLDING_DAMPING;
    }
    let outcome = iterate(model, data, gravity, tolerance, &held_dofs, &held_points);
    data.damping = damping;
    stop(data);
    forward_kinematics(model, data);
    outcome
}

/// Sets all velocities to zero.
fn stop(data: &mut Data) {
    data.v.fill(0.0);
    data.point_v_world.fill(Vec3::zeros());
}

fn iterate(
    model: &Model,
    data: &mut Data,
    gravity: &Vec3,
    tolerance: f64,
    held_dofs: &[usize],
    held_points: &[usize],
) -> Result<usize, StaticsError> {
    let (mut h, mut longest) = (LONGEST_STEP, LONGEST_STEP);
    let mut moved = f64::INFINITY;
    let (mut last_dofs, mut last_points) = (vec![0.0; model.nv()], vec![Vec3::zeros(); model.points.len()]);
    for iteration in 1..=MAX_ITERATIONS {
        stop(data);
        forward_kinematics(model, data);
        free_change(model, data, h, gravity, Solver::Aba);
        for &dof in held_dofs {
            data.change.dof[dof] = 0.0;
        }
        for &index in held_points {
            data.change.point[index] = Vec3::zeros();
        }
        let change = &data.change;
        let joint_move = h * change.dof.iter().fold(0.0_f64, |most, dv| most.max(dv.abs()));
        let point_move = h * change.point.iter().fold(0.0_f64, |most, dv| most.max(dv.amax()));
        moved = joint_move.max(point_move);
        if !moved.is_finite() {
            return Err(StaticsError::NotConverged { iterations: iteration, step: moved });
        }
        if moved <= tolerance {
            advance(model, data, h);
            return Ok(iteration);
        }
        let turn = std::iter::zip(&change.dof, &last_dofs).map(|(a, b)| a * b).sum::<f64>()
            + std::iter::zip(&change.point, &last_points).map(|(a, b)| a.dot(b)).sum::<f64>();
        last_dofs.clone_from(&change.dof);
        last_points.clone_from(&change.point);
        advance(model, data, h * (LARGEST_MOVE / joint_move).min(1.0));
        if turn < 0.0 && iteration > PATIENCE {
            longest = (longest * SHORTENED).max(SHORTEST_STEP);
        }
        h = if turn < 0.0 { (h * CUT).min(FIRST_CUT) } else { (h / CUT.sqrt()).min(longest) };
    }
    if moved <= NEARLY {
        return Ok(MAX_ITERATIONS);
    }
    Err(StaticsError::NotConverged { iterations: MAX_ITERATIONS, step: moved })
}
