//! Inverse kinematics by damped least squares.
//!
//! One step is `dq = J^T (J J^T + mu I)^-1 e` plus a motion towards the home posture in the null space, with
//! mu = |e|^2 / 2 + damping^2 (`sugihara2011`, eq. 19). A joint that would leave its limits stops
//! there and the step is solved again without it. Restarts begin at points of an additive recurrence over the joint ranges, so that equal
//! calls give equal answers.

use crate::arm::ArmKinematics;
use crate::chain::Jacobian;
use crate::joint_values::JointVector;
use crate::joint_values::MAX_ARM_DOF;
use nalgebra::{Matrix6, Vector6};
use orchard_geometry::{Mat3, Pose, Vec3, math};

/// Target of the point between the finger pads (TCP), in the base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IkTarget {
    /// A full pose of the TCP.
    Pose(Pose),
    /// A position and the direction of the approach axis (unit vector); the roll about it is free.
    Axis {
        /// Position of the TCP \[m\].
        p_base: Vec3,
        /// Direction of the TCP's z.
        z_base: Vec3,
    },
}

/// Reason for which no posture was found.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum IkFailure {
    /// The target or the start is not finite.
    #[error("inverse kinematics: the target or the start posture is not finite")]
    NotFinite,
    /// The best posture found misses the target.
    #[error("inverse kinematics: nearest posture is off by {position} m and {angle} rad")]
    Unreachable {
        /// Remaining distance \[m\].
        position: f64,
        /// Remaining angle \[rad\].
        angle: f64,
    },
}

/// Below this sine two directions count as parallel.
const PARALLEL: f64 = 1e-9;

/// Error of a posture, angular part first, and the Jacobian's rows projected onto the constrained directions.
pub(crate) struct Residual {
    pub error: Vector6<f64>,
    pub jacobian: Jacobian,
    pub position: f64,
    pub angle: f64,
}

/// Rotation vector that carries unit vector `a` onto unit vector `b`.
fn turn_between(a: &Vec3, b: &Vec3) -> Vec3 {
    let cross = a.cross(b);
    let sin = cross.norm();
    if sin > PARALLEL {
        return cross * (math::atan2(sin, a.dot(b)) / sin);
    }
    if a.dot(b) > 0.0 {
        return Vec3::zeros();
    }
    let other = if a.x.abs() < 0.5 { Vec3::x() } else { Vec3::y() };
    a.cross(&other).normalize() * std::f64::consts::PI
}

impl ArmKinematics {
    /// Finds a posture that meets the target within the configured tolerances and the joint limits, from `q_start`, else from the home
    /// posture and the configured number of restarts.
    ///
    /// # Errors
    /// No posture was found, or an input is not finite.
    pub fn solve(&self, target: &IkTarget, q_start: &JointVector) -> Result<JointVector, IkFailure> {
        self.with_restarts(q_start, |start| self.solve_near(target, start))
    }

    /// Tries the start, the home posture and the configured number of further postures.
    pub(crate) fn with_restarts(
        &self,
        q_start: &JointVector,
        solve: impl Fn(&JointVector) -> Result<JointVector, IkFailure>,
    ) -> Result<JointVector, IkFailure> {
        let mut best = match solve(q_start) {
            Err(IkFailure::Unreachable { position, angle }) => (position, angle),
            done => return done,
        };
        for attempt in 0..=self.ik.restarts {
            let start = if attempt == 0 { self.home } else { self.spread_posture(attempt) };
            match solve(&start) {
                Err(IkFailure::Unreachable { position, angle }) if position + angle < best.0 + best.1 => {
                    best = (position, angle);
                }
                Err(_) => {}
                done => return done,
            }
        }
        Err(IkFailure::Unreachable { position: best.0, angle: best.1 })
    }

    /// True if a residual is within the tolerances.
    pub(crate) fn meets(&self, residual: &Residual) -> bool {
        residual.position <= self.ik.position_tolerance && residual.angle <= self.ik.angle_tolerance
    }

    /// Solves as [`ArmKinematics::solve`] does, without restarts: the posture connects to `q_start` continuously.
    ///
    /// # Errors
    /// No posture was found, or an input is not finite.
    pub fn solve_near(&self, target: &IkTarget, q_start: &JointVector) -> Result<JointVector, IkFailure> {
        if !target.is_finite() || q_start.iter().any(|x| !x.is_finite()) {
            return Err(IkFailure::NotFinite);
        }
        let beyond = self.beyond(target);
        if beyond > 0.0 {
            return Err(IkFailure::Unreachable { position: beyond, angle: 0.0 });
        }
        let mut q = self.clamped(q_start);
        for _ in 0..self.ik.iterations {
            let residual = self.residual(target, &q);
            if residual.position <= self.ik.position_tolerance && residual.angle <= self.ik.angle_tolerance {
                return Ok(q);
            }
            q = self.clamped(&(q + self.step(&q, residual)));
        }
        let residual = self.residual(target, &q);
        Err(IkFailure::Unreachable { position: residual.position, angle: residual.angle })
    }

    /// Length that a stretched arm is too short for a target, less the tolerances \[m\]. With 0 or less the arm may reach it or not. The pose of the TCP fixes that of the last link, so only the joints before it have to reach.
    fn beyond(&self, target: &IkTarget) -> f64 {
        let IkTarget::Pose(x_base_tcp) = target else { return 0.0 };
        let x_wrist_tcp = &self.mounts.x_wrist_tcp;
        // A posture within the tolerances has the last link off by this much at the shoulder.
        let lever = (x_base_tcp.translation.vector - self.shoulder()).norm();
        let slack = self.ik.position_tolerance + self.ik.angle_tolerance * lever;
        self.chain.apart(&(x_base_tcp * x_wrist_tcp.inverse())) - self.stretch - slack
    }

    /// Follows a pose of the TCP (base frame) by a number of damped steps from `q_start`, within the joint limits. The posture connects to
    /// `q_start` continuously. A pose that the arm cannot take is approached.
    pub fn follow(&self, x_base_tcp: &Pose, q_start: &JointVector, steps: u32) -> JointVector {
        let target = IkTarget::Pose(*x_base_tcp);
        (0..steps).fold(self.clamped(q_start), |q, _| {
            let step = self.step(&q, self.residual(&target, &q));
            self.clamped(&(q + step))
        })
    }

    pub(crate) fn residual(&self, target: &IkTarget, q: &JointVector) -> Residual {
        let (x, mut jacobian) = self.tcp_and_jacobian(q);
        let (p, turn) = match target {
            IkTarget::Pose(goal) => {
                (goal.translation.vector, (goal.rotation * x.rotation.inverse()).scaled_axis())
            }
            IkTarget::Axis { p_base, z_base } => {
                let z = x.rotation * Vec3::z();
                // The roll about the approach axis is free: it has no error and no row.
                let constrained = Mat3::identity() - z * z.transpose();
                let angular = constrained * jacobian.fixed_view::<3, MAX_ARM_DOF>(0, 0);
                jacobian.fixed_view_mut::<3, MAX_ARM_DOF>(0, 0).copy_from(&angular);
                (*p_base, turn_between(&z, z_base))
            }
        };
        let distance = p - x.translation.vector;
        let mut error = Vector6::zeros();
        error.fixed_rows_mut::<3>(0).copy_from(&turn);
        error.fixed_rows_mut::<3>(3).copy_from(&distance);
        Residual { error, jacobian, position: distance.norm(), angle: turn.norm() }
    }

    fn step(&self, q: &JointVector, residual: Residual) -> JointVector {
        let Residual { error, mut jacobian, .. } = residual;
        let mu = 0.5 * error.norm_squared() + self.ik.damping * self.ik.damping;
        // The motion towards home fades with the error, so that the solution meets its target.
        let mut homeward = (self.home - q) * (self.ik.home_gain * error.norm().min(1.0));
        let mut stopped = [false; MAX_ARM_DOF];
        loop {
            let gram = jacobian * jacobian.transpose() + Matrix6::identity() * mu;
            let Some(factor) = gram.cholesky() else { return JointVector::zeros() };
            let along = |rows: Vector6<f64>| jacobian.transpose() * factor.solve(&rows);
            let mut dq = along(error) + homeward - along(jacobian * homeward);
            let largest = dq.amax();
            if largest > self.ik.step_max {
                dq *= self.ik.step_max / largest;
            }
            let leaves = |i: &usize| {
                let (limit, next) = (self.limits[*i], q[*i] + dq[*i]);
                !stopped[*i]
                    && ((dq[*i] < 0.0 && q[*i] <= limit.lower && next < limit.lower)
                        || (dq[*i] > 0.0 && q[*i] >= limit.upper && next > limit.upper))
            };
            let Some(i) = (0..self.dof()).find(leaves) else { return dq };
            stopped[i] = true;
            homeward[i] = 0.0;
            jacobian.column_mut(i).fill(0.0);
        }
    }

    /// Points that fill the joint ranges evenly: the additive recurrence n * alpha mod 1 with
    /// alpha_k = phi^-k, phi the positive root of x^(n + 1) = x + 1 for n joints.
    pub(crate) fn spread_posture(&self, n: u32) -> JointVector {
        let mut phi = 1.1_f64;
        for _ in 0..30 {
            phi = math::pow(1.0 + phi, 1.0 / (self.dof() as f64 + 1.0));
        }
        let mut alpha = 1.0;
        JointVector::from_fn(|i, _| {
            alpha /= phi;
            let fraction = (0.5 + f64::from(n) * alpha).fract();
            let limit = self.limits[i];
            limit.lower + fraction * (limit.upper - limit.lower)
        })
    }
}

impl IkTarget {
    pub(crate) fn is_finite(&self) -> bool {
        match self {
            IkTarget::Pose(x) => {
                x.translation.vector.iter().chain(x.rotation.coords.iter()).all(|v| v.is_finite())
            }
            IkTarget::Axis { p_base, z_base } => p_base.iter().chain(z_base.iter()).all(|v| v.is_finite()),
        }
    }
}
