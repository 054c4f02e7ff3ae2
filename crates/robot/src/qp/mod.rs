//! Inverse kinematics as a quadratic program at control rate: joint velocities that follow a twist of the TCP within the joint limits and
//! clear of links and obstacles.
//!
//! One step minimises `(|J v - t|_W^2 + lambda |v - v_n|^2)/2 + sum_k rho_k s_k` over the joint velocities v and the
//! slacks s >= 0 (`kanoun2011priority`, without its priorities). t is the wanted twist, v_n the motion towards the preferred
//! posture in the null space of J. Constraints:
//!
//! - position, speed and acceleration of each joint, as one range of velocities that is never empty (`braking.rs`);
//! - `g . v >= -gamma (d - d_min)` for each watched pair of links at distance d with gradient g
//!   (`faverjon1987local`); if these cannot be met within the accelerations, the step is solved again with slacks of their own, which cost
//!   more than all others;
//! - the same with a slack for each pair of a link and an obstacle.
//!
//! A step that is not solved brakes every joint with the greatest acceleration. No state is kept between steps, so equal arguments give
//! equal bits.

mod pose;
mod problem;

use crate::arm::ArmKinematics;
use crate::braking::velocity_range;
use crate::chain::Jacobian;
use crate::clearance::{Nearness, Posture};
use crate::ik::{IkTarget, Residual};
use crate::joint_values::JointVector;
use crate::joint_values::MAX_ARM_DOF;
use nalgebra::{Matrix6, SMatrix, Vector6};
use orchard_geometry::{Shape, Vec3};
use problem::{Problem, Row};

/// Positions and velocities of the arm's set points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QpState {
    /// Joint positions \[rad\].
    pub q: JointVector,
    /// Joint velocities of the last step [rad/s].
    pub v: JointVector,
}

impl QpState {
    /// Makes a state at rest.
    pub fn resting(q: JointVector) -> Self {
        Self { q, v: JointVector::zeros() }
    }
}

/// Task of the TCP.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum QpTask {
    /// Move with a twist: angular velocity [rad/s], then linear velocity [m/s], base axes, at the TCP.
    Twist(Vector6<f64>),
    /// Approach a target: error times gain, at no more than the speeds.
    Approach {
        /// Target of the TCP.
        target: IkTarget,
        /// Rate at which the error decays [1/s].
        gain: f64,
        /// Largest linear speed [m/s].
        speed: f64,
        /// Largest angular speed [rad/s].
        turn_speed: f64,
    },
}

/// Goal of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QpGoal {
    /// Motion of the TCP.
    pub task: QpTask,
    /// Preferred posture \[rad\], for the null space of the task.
    pub posture: JointVector,
    /// Radius of a ball that the hand holds at the TCP \[m\].
    pub held: Option<f64>,
}

/// A point that the arm, the hand and its load should keep clear of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// Position, base frame \[m\].
    pub p_base: Vec3,
    /// Distance to keep \[m\].
    pub clearance: f64,
    /// Penalty for coming nearer than that [m/s]: the obstacle yields where the TCP would lag by more in its direction. Twigs may have a
    /// small penalty, a trunk a large one; it is capped at a tenth of the penalty between links.
    pub penalty: f64,
}

impl Obstacle {
    fn is_finite(&self) -> bool {
        let figures = [self.clearance, self.penalty];
        self.p_base.iter().chain(&figures).all(|x| x.is_finite()) && self.penalty >= 0.0
    }
}

/// Outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QpStatus {
    /// All constraints hold; only joint limits were active, if any.
    Free,
    /// All constraints hold; distances were active.
    Constrained,
    /// The links could not keep their distances from each other within the accelerations; the constraints were relaxed.
    Relaxed,
    /// The step was not solved, or the goal is not finite: every joint brakes.
    Braking,
    /// The state is not finite: it is returned unchanged, at rest.
    NotFinite,
}

/// A step of the set points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QpStep {
    /// Joint velocities over the step [rad/s].
    pub v: JointVector,
    /// Joint positions at its end \[rad\], within their limits.
    pub q_next: JointVector,
    /// Largest slack of a constraint on a distance [m/s].
    pub slack: f64,
    /// Outcome.
    pub status: QpStatus,
}

impl QpGoal {
    fn is_finite(&self) -> bool {
        let task = match &self.task {
            QpTask::Twist(twist) => twist.iter().all(|x| x.is_finite()),
            QpTask::Approach { target, gain, speed, turn_speed } => {
                target.is_finite() && [gain, speed, turn_speed].iter().all(|x| x.is_finite() && **x >= 0.0)
            }
        };
        task && self.posture.iter().all(|x| x.is_finite())
            && self.held.is_none_or(|r| r.is_finite() && r > 0.0)
    }
}

impl ArmKinematics {
    /// Computes one control step of length `dt` \[s\]: the joint velocities that serve the goal best within the limits and clear of the
    /// obstacles. The module's docs give the objective. Obstacles that are not finite are ignored.
    pub fn velocity_step(&self, state: &QpState, goal: &QpGoal, obstacles: &[Obstacle], dt: f64) -> QpStep {
        let QpState { q, v } = state;
        if q.iter().chain(v.iter()).any(|x| !x.is_finite()) || !(dt.is_finite() && dt > 0.0) {
            return QpStep { v: JointVector::zeros(), q_next: *q, slack: 0.0, status: QpStatus::NotFinite };
        }
        let ranges: [(f64, f64); MAX_ARM_DOF] =
            std::array::from_fn(|i| velocity_range(q[i], v[i], &self.limits[i], self.qp.acceleration, dt));
        let lower = JointVector::from_fn(|i, _| ranges[i].0);
        let upper = JointVector::from_fn(|i, _| ranges[i].1);
        let finish = |v: &JointVector, slack: f64, status: QpStatus| {
            let v = v.zip_zip_map(&lower, &upper, |v, low, high| v.max(low).min(high));
            QpStep { v, q_next: self.clamped(&(q + v * dt)), slack, status }
        };
        let brake = || finish(&JointVector::zeros(), 0.0, QpStatus::Braking);
        if !goal.is_finite() {
            return brake();
        }
        let (twist, jacobian) = self.twist(q, &goal.task);
        let mut problem = self.tracking(q, &twist, &jacobian, &goal.posture);
        (problem.lower, problem.upper) = (lower, upper);
        let ball = goal.held.map(|radius| Shape::Sphere { radius });
        let mut posture = Posture::new(self, q, ball.as_ref());
        self.keep_from_itself(&mut posture, &mut problem.rows);
        let own_rows = problem.rows.len();
        self.keep_from(&mut posture, obstacles, &mut problem.rows);
        if let Some(found) = problem.solve(self.qp.iterations) {
            let status = if found.is_free { QpStatus::Free } else { QpStatus::Constrained };
            return finish(&found.v, found.slack, status);
        }
        for row in &mut problem.rows[..own_rows] {
            row.penalty = Some(self.qp.self_penalty);
        }
        match problem.solve(self.qp.iterations) {
            Some(found) => finish(&found.v, found.slack, QpStatus::Relaxed),
            None => brake(),
        }
    }

    /// Returns the wanted twist of a task and the rows of the Jacobian that produce it.
    fn twist(&self, q: &JointVector, task: &QpTask) -> (Vector6<f64>, Jacobian) {
        match task {
            QpTask::Twist(twist) => (*twist, self.jacobian(q)),
            QpTask::Approach { target, gain, speed, turn_speed } => {
                let Residual { error, jacobian, .. } = self.residual(target, q);
                let mut twist = error * *gain;
                let turn = twist.fixed_rows::<3>(0).cap_magnitude(*turn_speed);
                let linear = twist.fixed_rows::<3>(3).cap_magnitude(*speed);
                twist.fixed_rows_mut::<3>(0).copy_from(&turn);
                twist.fixed_rows_mut::<3>(3).copy_from(&linear);
                (twist, jacobian)
            }
        }
    }

    /// Returns the program with the tracking objective and no constraints.
    fn tracking(
        &self,
        q: &JointVector,
        twist: &Vector6<f64>,
        jacobian: &Jacobian,
        posture: &JointVector,
    ) -> Problem {
        let c = &self.qp;
        let mut weights = Vector6::repeat(1.0);
        weights.fixed_rows_mut::<3>(0).fill(c.angle_weight);
        let weighed = SMatrix::from_diagonal(&weights) * jacobian;
        let homeward = (posture - q) * c.posture_gain;
        let homeward =
            JointVector::from_fn(|i, _| homeward[i].clamp(-self.limits[i].velocity, self.limits[i].velocity));
        let free = null_space_part(jacobian, &homeward, c.damping);
        let hessian = jacobian.transpose() * weighed + SMatrix::identity() * c.damping;
        Problem::new(self.dof(), hessian, weighed.transpose() * twist + free * c.damping)
    }

    fn keep_from_itself(&self, posture: &mut Posture, rows: &mut Vec<Row>) {
        let c = &self.qp;
        for pair in posture.near_itself(&self.pairs, c.influence) {
            let least = -c.approach_rate * (pair.distance - c.self_clearance);
            rows.push(Row { gradient: pair.gradient, least, penalty: None });
        }
    }

    /// Rows for the nearest pairs of a link and an obstacle.
    fn keep_from(&self, posture: &mut Posture, obstacles: &[Obstacle], rows: &mut Vec<Row>) {
        let c = &self.qp;
        let mut near: Vec<(Nearness, f64)> = Vec::new();
        let mut found = Vec::new();
        for obstacle in obstacles.iter().filter(|o| o.is_finite()) {
            posture.near_ball(&obstacle.p_base, obstacle.clearance.max(0.0), c.influence, &mut found);
            let penalty = obstacle.penalty.min(0.1 * c.self_penalty);
            near.extend(found.drain(..).map(|nearness| (nearness, penalty)));
        }
        // The sort is stable: equal distances stay in the caller's order.
        near.sort_by(|a, b| a.0.distance.total_cmp(&b.0.distance));
        near.truncate(c.canopy_rows);
        rows.extend(near.iter().map(|(near, penalty)| Row {
            gradient: near.gradient,
            least: -c.approach_rate * near.distance,
            penalty: Some(*penalty),
        }));
    }
}

/// Projects a joint motion onto the null space of the task: removes the part that moves the TCP.
fn null_space_part(jacobian: &Jacobian, motion: &JointVector, damping: f64) -> JointVector {
    let gram = jacobian * jacobian.transpose() + Matrix6::identity() * damping;
    match gram.cholesky() {
        Some(factor) => motion - jacobian.transpose() * factor.solve(&(jacobian * motion)),
        None => JointVector::zeros(),
    }
}
