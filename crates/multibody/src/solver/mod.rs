//! The linear solvers of a step, behind one enum: same system, same solution.
//!
//! The unknowns are the velocity changes of the joints, then of the point bodies; A is the matrix of
//! [`crate::aba`]. Every solver leaves the anchor of a capped tether out of its point's row of A.

mod cg;
#[cfg(feature = "cholesky")]
pub(crate) mod cholesky;
mod entries;
pub(crate) mod scratch;
pub(crate) mod system;
mod update;

use serde::{Deserialize, Serialize};

use crate::aba::factors::Factor;
use crate::aba::{self, Change, Impulse};
use crate::data::Data;
use crate::kinematics::Kinematics;
use crate::model::Model;
use scratch::LinearScratch;

/// Solver of `A dv = impulse`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Solver {
    /// The articulated-body algorithm: exact, O(n).
    #[default]
    Aba,
    /// Conjugate gradients on the product A x, one root-to-leaf and one leaf-to-root sweep: no matrix.
    Cg {
        /// Preconditioner of the residual.
        preconditioner: Preconditioner,
    },
    /// A sparse Cholesky factor (QDLDL, of `clarabel`) of the assembled matrix, leaves first, without fill-in; contacts by
    /// Newton on the assembled `A + J^T G J`. A cross-check: it allocates at each solve and no result uses it.
    #[cfg(feature = "cholesky")]
    Cholesky,
}

/// Approximate inverse of A for [`Solver::Cg`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preconditioner {
    /// The identity.
    None,
    /// The inverse of A's diagonal.
    Jacobi,
    /// The articulated-body factor. It is A's exact inverse, tethers included, so that one iteration is enough.
    #[default]
    ArticulatedBody,
}

/// Outcome of a linear solve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LinearSolve {
    /// Iterations; 0 of a direct solver.
    pub iterations: usize,
    /// `|b - A x| / |b|` of the true residual, each entry scaled by 1 / sqrt(A_ii), so that its square is an energy;
    /// 0 of a direct solver, which does not measure it.
    pub residual: f64,
    /// True if the tolerance was met.
    pub converged: bool,
}

impl Default for LinearSolve {
    /// Outcome of a system without unknowns.
    fn default() -> LinearSolve {
        LinearSolve { iterations: 0, residual: 0.0, converged: true }
    }
}

impl LinearSolve {
    /// Two solves as one: all iterations, the larger residual.
    pub(crate) fn and(self, other: LinearSolve) -> LinearSolve {
        LinearSolve {
            iterations: self.iterations + other.iterations,
            residual: self.residual.max(other.residual),
            converged: self.converged && other.converged,
        }
    }
}

/// Prepares solves for the substep `h` at the last kinematics: the articulated-body factor, which contacts take as
/// well, and the factor or matrix of the solver itself.
pub(crate) fn factor(solver: Solver, model: &Model, data: &mut Data, h: f64) {
    aba::factor(model, data, h);
    if solver == Solver::Aba {
        return;
    }
    let mut linear = std::mem::take(&mut data.linear);
    linear.system.update(model, data, h);
    #[cfg(feature = "cholesky")]
    if solver == Solver::Cholesky {
        linear.cholesky = cholesky::SparseFactor::of_system(model, &data.kinematics, &linear.system);
    }
    data.linear = linear;
}

/// Solves `A change = impulse` with the last [`factor`]. The impulse is used as scratch and overwritten.
pub(crate) fn solve(
    solver: Solver,
    model: &Model,
    (kinematics, factor): (&Kinematics, &Factor),
    linear: &mut LinearScratch,
    impulse: &mut Impulse,
    change: &mut Change,
) -> LinearSolve {
    let outcome = match solver {
        Solver::Aba => {
            aba::solve_with(model, kinematics, factor, impulse, change);
            return LinearSolve::default();
        }
        Solver::Cg { preconditioner } => {
            let LinearScratch { system, cg, impulse: inner, change: inner_change, .. } = linear;
            system.gather(model, kinematics, impulse, cg.rhs(system.size()));
            match preconditioner {
                Preconditioner::None => cg.solve(model, kinematics, system, |_, r, z| z.copy_from_slice(r)),
                Preconditioner::Jacobi => cg.solve(model, kinematics, system, |system, r, z| {
                    for ((z, r), inverse) in z.iter_mut().zip(r).zip(&system.inverse_diagonal) {
                        *z = r * inverse;
                    }
                }),
                Preconditioner::ArticulatedBody => {
                    inner.reserve(model);
                    inner_change.reserve(model);
                    cg.solve(model, kinematics, system, |_, r, z| {
                        inner.set_entries(r);
                        aba::solve_with(model, kinematics, factor, inner, inner_change);
                        inner_change.write_entries(z);
                    })
                }
            }
        }
        #[cfg(feature = "cholesky")]
        Solver::Cholesky => {
            let LinearScratch { system, cg, cholesky, .. } = linear;
            system.gather(model, kinematics, impulse, cg.rhs(system.size()));
            cg.solve_with_factor(cholesky.as_ref())
        }
    };
    let LinearScratch { system, cg, .. } = linear;
    system.scatter(model, kinematics, cg.solution(), change);
    outcome
}
