//! Preconditioned conjugate gradients on the product with A (Hestenes and Stiefel 1952), started again from the true
//! residual until that is small.

use super::LinearSolve;
use super::system::System;
use crate::kinematics::Kinematics;
use crate::model::Model;
use crate::vectors::{add_scaled, dot};

/// Relative residual at which a solve ends.
const TOLERANCE: f64 = 1e-12;
/// Iterations for each unknown before the solve gives up; without round-off one is enough.
const MAX_ITERATIONS_PER_UNKNOWN: usize = 100;
/// A restart from the true residual must shrink it to this share, or it is at its floor of round-off.
const RESTART_GAIN: f64 = 0.5;

/// Buffers, and the last solution.
#[derive(Debug, Clone, Default)]
pub(super) struct ConjugateGradients {
    b: Vec<f64>,
    x: Vec<f64>,
    r: Vec<f64>,
    z: Vec<f64>,
    d: Vec<f64>,
    ad: Vec<f64>,
}

/// `sqrt(sum r_i^2 / A_ii)`.
fn scaled_norm(r: &[f64], inverse_diagonal: &[f64]) -> f64 {
    r.iter().zip(inverse_diagonal).map(|(r, inverse)| r * r * inverse).sum::<f64>().sqrt()
}

impl ConjugateGradients {
    /// The right-hand side of the next solve.
    pub fn rhs(&mut self, size: usize) -> &mut [f64] {
        for buffer in [&mut self.b, &mut self.x, &mut self.r, &mut self.z, &mut self.d, &mut self.ad] {
            buffer.resize(size, 0.0);
        }
        &mut self.b
    }

    /// The last solution.
    pub fn solution(&self) -> &[f64] {
        &self.x
    }

    /// Solves with a factor of A instead. Without one (A is not positive definite) the change is zero.
    #[cfg(feature = "cholesky")]
    pub fn solve_with_factor(&mut self, factor: Option<&super::cholesky::SparseFactor>) -> LinearSolve {
        let Some(factor) = factor else {
            self.x.fill(0.0);
            return LinearSolve { iterations: 0, residual: 1.0, converged: false };
        };
        self.x.copy_from_slice(&self.b);
        factor.solve(&mut self.x);
        LinearSolve::default()
    }

    /// Solves `A x = b`; `precondition(system, r, z)` writes z.
    pub fn solve(
        &mut self,
        model: &Model,
        kinematics: &Kinematics,
        system: &mut System,
        mut precondition: impl FnMut(&System, &[f64], &mut [f64]),
    ) -> LinearSolve {
        let ConjugateGradients { b, x, r, z, d, ad } = self;
        x.fill(0.0);
        r.copy_from_slice(b);
        let size = scaled_norm(b, &system.inverse_diagonal);
        if size == 0.0 {
            return LinearSolve::default();
        }
        let most = MAX_ITERATIONS_PER_UNKNOWN * b.len();
        let (mut iterations, mut residual) = (0, 1.0);
        loop {
            // From the true residual: the one that the recurrence updates drifts away from it by round-off.
            precondition(system, r, z);
            d.copy_from_slice(z);
            let mut rz = dot(r, z);
            let mut estimate: f64 = residual;
            while estimate > TOLERANCE && iterations < most {
                iterations += 1;
                system.multiply(model, kinematics, d, ad);
                let curvature = dot(d, ad);
                if curvature <= 0.0 {
                    break;
                }
                let length = rz / curvature;
                add_scaled(x, d, length);
                add_scaled(r, ad, -length);
                estimate = scaled_norm(r, &system.inverse_diagonal) / size;
                precondition(system, r, z);
                let next = dot(r, z);
                let turn = next / rz;
                rz = next;
                for (d, z) in d.iter_mut().zip(&*z) {
                    *d = z + turn * *d;
                }
            }
            system.multiply(model, kinematics, x, ad);
            for ((r, b), ax) in r.iter_mut().zip(&*b).zip(&*ad) {
                *r = b - ax;
            }
            let before = residual;
            residual = scaled_norm(r, &system.inverse_diagonal) / size;
            let converged = residual <= TOLERANCE;
            // A state that is not finite has no residual.
            let is_stuck = !residual.is_finite() || residual > RESTART_GAIN * before;
            if converged || iterations >= most || is_stuck {
                return LinearSolve { iterations, residual, converged };
            }
        }
    }
}
