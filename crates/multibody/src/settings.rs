//! Settings of a substep, and its report.

use orchard_geometry::Vec3;
use serde::{Deserialize, Serialize};

use crate::contact::report::ContactReport;
use crate::solver::{LinearSolve, Solver};

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

/// Algorithm that finds the contact impulses. Each gives the same solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ContactPath {
    /// Under [`Solver::Aba`] the faster of the two by the number of rows, see
    /// [`DIRECT_ROWS`](crate::contact::DIRECT_ROWS); matrix-free under [`Solver::Cg`].
    #[default]
    ByRows,
    /// Conjugate gradients preconditioned by the articulated-body factor, on generalised velocities.
    MatrixFree,
    /// A dense factor over the rows, on contact impulses.
    Delassus,
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
