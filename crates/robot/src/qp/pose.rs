//! Inverse kinematics for a pose by quadratic programs, with joint limits and self-collision as constraints of every step.

use super::problem::{Problem, Row};
use crate::arm::ArmKinematics;
use crate::clearance::Posture;
use crate::ik::{IkFailure, IkTarget, Residual};
use crate::joint_values::JointVector;
use nalgebra::SMatrix;

/// Largest joint step at which a search counts as converged \[rad\].
const STALLED: f64 = 1e-7;

impl ArmKinematics {
    /// Finds a posture that meets the target within the tolerances of [`ArmKinematics::solve`], the joint limits and the clearance between
    /// links, from `q_start`, else from the home posture and the same restarts as there. If none of them leads to a posture with that
    /// clearance, they are tried again with links that may come as near as touching.
    ///
    /// A step minimises `|J dq - e|^2 + mu |dq - dq_n|^2` with the damping mu and the homeward motion dq_n of damped least
    /// squares, subject to `|dq|` under the largest step, the joint ranges and `d + g . dq >= d_min`.
    ///
    /// # Errors
    /// No posture was found, or an input is not finite.
    pub fn solve_qp(&self, target: &IkTarget, q_start: &JointVector) -> Result<JointVector, IkFailure> {
        let clear = self.with_restarts(q_start, |start| self.solve_qp_near(target, start));
        match clear {
            Err(IkFailure::Unreachable { .. }) => {
                self.with_restarts(q_start, |start| self.solve_qp_apart(target, start, 0.0))
            }
            done => done,
        }
    }

    /// Solves as [`ArmKinematics::solve_qp`] does, without restarts and with the clearance between links.
    ///
    /// # Errors
    /// No posture was found, or an input is not finite.
    pub fn solve_qp_near(&self, target: &IkTarget, q_start: &JointVector) -> Result<JointVector, IkFailure> {
        self.solve_qp_apart(target, q_start, self.qp.self_clearance)
    }

    /// Solves without restarts, with steps that keep links apart by a distance \[m\].
    fn solve_qp_apart(
        &self,
        target: &IkTarget,
        q_start: &JointVector,
        apart: f64,
    ) -> Result<JointVector, IkFailure> {
        if !target.is_finite() || q_start.iter().any(|x| !x.is_finite()) {
            return Err(IkFailure::NotFinite);
        }
        let mut q = self.clamped(q_start);
        for _ in 0..self.ik.iterations {
            let residual = self.residual(target, &q);
            let near = Posture::new(self, &q, None).near_itself(&self.pairs, self.qp.influence);
            let is_clear = near.iter().all(|pair| pair.distance >= 0.0);
            if is_clear && self.meets(&residual) {
                return Ok(q);
            }
            let rows = near.iter().map(|pair| Row {
                gradient: pair.gradient,
                least: apart - pair.distance,
                penalty: None,
            });
            let step = self.pose_step(&q, &residual, rows.collect());
            q = self.clamped(&(q + step));
            if step.amax() < STALLED {
                break;
            }
        }
        let residual = self.residual(target, &q);
        if self.meets(&residual) && self.self_distance(&q).distance >= 0.0 {
            return Ok(q);
        }
        Err(IkFailure::Unreachable { position: residual.position, angle: residual.angle })
    }

    fn pose_step(&self, q: &JointVector, residual: &Residual, rows: Vec<Row>) -> JointVector {
        let Residual { error, jacobian, .. } = residual;
        let mu = 0.5 * error.norm_squared() + self.ik.damping * self.ik.damping;
        let homeward = (self.home - q) * (self.ik.home_gain * error.norm().min(1.0));
        let free = super::null_space_part(jacobian, &homeward, mu);
        let hessian = jacobian.transpose() * jacobian + SMatrix::identity() * mu;
        let mut problem = Problem::new(self.dof(), hessian, jacobian.transpose() * error + free * mu);
        problem.lower = JointVector::from_fn(|i, _| (self.limits[i].lower - q[i]).max(-self.ik.step_max));
        problem.upper = JointVector::from_fn(|i, _| (self.limits[i].upper - q[i]).min(self.ik.step_max));
        problem.rows = rows;
        if let Some(found) = problem.solve(self.qp.iterations) {
            return found.v;
        }
        for row in &mut problem.rows {
            row.penalty = Some(self.qp.self_penalty);
        }
        problem.solve(self.qp.iterations).map_or(JointVector::zeros(), |found| found.v)
    }
}
