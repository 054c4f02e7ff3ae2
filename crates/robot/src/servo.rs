//! Servos: turn commands into implicit springs, dampers and torques of a world's model, once a substep.
//!
//! A servo with position gain k, velocity gain d and feed-forward f exerts `k (target - q') - d v' + f` with the
//! state (q', v') at the end of the substep: the step takes k and d implicitly. Where that would exceed the effort limit, the servo exerts
//! the limit with no gains. The effort is predicted from the inertia J that the joint moves,
//! `(k (target - q - h v) - d v) / (1 + h (d + h k) / J)`, so that a stiff servo does not flip between the two. The velocity drives of the
//! base exert `d / (1 + h d / M) (set - v)`, cut off at their bound: the same damping in a form that no collision can push over the bound.
//!
//! A finger's servo is given at its pad, in metres and newtons. On a hinge it acts as the same spring and damper on a lever `ds/dq` ([`crate::finger`]).
//!
//! The arm's set points obey the joints' speed and acceleration limits. A command gives their positions at the end of the frame and their
//! velocities there. Meanwhile they move at those velocities, plus the largest speed from which their offset can be braked away
//! ([`crate::braking`]). So they follow a smooth command without lag and come to rest at a command of velocity 0.
//!
//! Between an arm's servo and its link lies the drivetrain ([`drivetrain`]): rotor inertia and friction, which the servo's limit and its
//! prediction leave out and which act beyond it.

mod base;
mod drivetrain;
mod parameters;

pub use base::{BaseServo, VelocityDrive};
pub use drivetrain::Drivetrain;
pub use parameters::{FingerServo, Gains, ServoParameters};

use crate::braking::{stopping_speed, velocity_range};
use crate::handle::RobotHandle;
use crate::io::Command;
use crate::joint_values::{JointValues, MAX_ARM_DOF};
use crate::model::RobotModel;
use drivetrain::Loss;
use orchard_geometry::Vec3;
use orchard_multibody::{Data, Model};
use serde::{Deserialize, Serialize};

/// Servos of one robot. They hold the set points, which move no faster than the hardware allows.
#[derive(Debug, Clone, PartialEq)]
pub struct Servos {
    robot: ServoParameters,
    kinematics: crate::ArmKinematics,
    set: SetPoints,
    /// Torques that friction and rotors take from the arm's servos in the present substep \[N m\].
    losses: [Loss; MAX_ARM_DOF],
}

/// Set points of a robot's servos: the part of [`Servos`] that a step changes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SetPoints {
    /// Velocity of the base in the base frame: forward [m/s], left [m/s], yaw rate [rad/s].
    pub base_velocity: [f64; 3],
    /// Positions of the arm's joints \[rad\].
    pub arm_target: JointValues,
    /// Their velocities [rad/s].
    pub arm_rate: JointValues,
    /// Openings of the fingers \[m\].
    pub finger_target: [f64; 2],
}

/// Drive of one degree of freedom in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Input {
    stiffness: f64,
    damping: f64,
    rest: f64,
    torque: f64,
}

impl Input {
    /// An effort without gains.
    fn constant(torque: f64) -> Self {
        Self { stiffness: 0.0, damping: 0.0, rest: 0.0, torque }
    }

    /// Returns the drive with what its drivetrain takes.
    fn with(self, loss: &Loss) -> Self {
        // Sums with nothing are left out, so that robots without losses keep their bits.
        if *loss == Loss::default() {
            return self;
        }
        Self { damping: self.damping + loss.damping(), torque: self.torque + loss.torque(), ..self }
    }
}

impl Gains {
    /// Gains about a joint of gains at the end of a lever \[m\].
    fn on_lever(&self, lever: f64) -> Self {
        let square = lever * lever;
        Self { stiffness: self.stiffness * square, damping: self.damping * square }
    }

    /// Applies the law of this module to one joint at (q, v) that moves `inertia`.
    fn input(&self, joint: &Joint, target: f64, feed_forward: f64, limit: f64, h: f64) -> Input {
        let Gains { stiffness, damping } = *self;
        let demand = stiffness * (target - joint.q - h * joint.v) - damping * joint.v;
        let predicted = feed_forward + demand / (1.0 + h * (damping + h * stiffness) / joint.inertia);
        if predicted.abs() <= limit {
            Input { stiffness, damping, rest: target, torque: feed_forward }
        } else {
            Input { stiffness: 0.0, damping: 0.0, rest: joint.q, torque: limit.copysign(predicted) }
        }
    }
}

struct Joint {
    q: f64,
    v: f64,
    inertia: f64,
}

fn write(data: &mut Data, dof: usize, input: Input) {
    data.stiffness[dof] = input.stiffness;
    data.damping[dof] = input.damping;
    data.rest[dof] = input.rest;
    data.torque[dof] = input.torque;
}

fn toward(from: f64, to: f64, step: f64) -> f64 {
    from + (to - from).clamp(-step, step)
}

/// Relative round-off of a torque that is at its limit.
const EFFORT_SLACK: f64 = 1e-9;

impl Servos {
    /// Makes servos that hold the start posture.
    pub fn new(robot: &RobotModel) -> Self {
        let start = robot.start_command();
        Self {
            set: SetPoints {
                base_velocity: [0.0; 3],
                arm_target: start.arm_q,
                arm_rate: JointValues::zeros(start.arm_q.len()),
                finger_target: [start.finger_q; 2],
            },
            losses: [Loss::default(); MAX_ARM_DOF],
            robot: ServoParameters::new(robot),
            kinematics: robot.kinematics().clone(),
        }
    }

    /// The set points.
    pub fn set_points(&self) -> &SetPoints {
        &self.set
    }

    /// Positions \[rad\] and velocities [rad/s] of the arm's set points.
    pub fn arm_set(&self) -> (JointValues, JointValues) {
        (self.set.arm_target, self.set.arm_rate)
    }

    /// Restores earlier set points.
    pub fn restore(&mut self, set: &SetPoints) {
        self.set = *set;
    }

    /// Sets the inputs of the next substep of length `h` \[s\], after which `remaining` \[s\] are left of the command's frame. `height` is the
    /// set point of the chassis height above its rest on flat ground \[m\]; `gravity` is a vector along z [m/s2]. A value of a command that
    /// is not finite brings its set point to rest.
    #[allow(
        clippy::too_many_arguments,
        reason = "a world's model, state and robot, and one substep's inputs"
    )]
    pub fn apply(
        &mut self,
        model: &Model,
        data: &mut Data,
        handle: &RobotHandle,
        command: &Command,
        height: f64,
        gravity: &Vec3,
        h: f64,
        remaining: f64,
    ) {
        if let Some(base) = &self.robot.base {
            let set = &mut self.set.base_velocity;
            base.apply(model, data, &handle.base_joint, set, &command.base_velocity, h);
        }
        if let (Some(body), Some(Gains { stiffness, damping })) = (handle.height, self.robot.height) {
            let weight = -self.robot.carried_mass * gravity.z;
            write(data, model.dofs(body).start, Input { stiffness, damping, rest: height, torque: weight });
        }
        self.drive_arm(model, data, handle, command, gravity, h, remaining);
        self.drive_fingers(model, data, handle, command, h);
    }

    /// Enforces the arm's effort limits and its Coulomb friction after contact, which the prediction cannot know. Call it after a substep: a
    /// servo that exerted more than its limit at the substep's end gets the limit as a constant torque, a joint that stuck under more than its
    /// friction slips, and the result is true if the substep must be repeated from its start.
    pub fn cap_overshoot(&mut self, model: &Model, data: &mut Data, handle: &RobotHandle) -> bool {
        let mut capped = false;
        let limits = self.kinematics.limits().iter().zip(&mut self.losses);
        for (&body, (limit, loss)) in handle.arm.iter().zip(limits) {
            let (dof, q) = (model.dofs(body).start, data.q[model.qs(body).start]);
            let mut servo = Input {
                stiffness: data.stiffness[dof],
                damping: data.damping[dof] - loss.damping(),
                rest: data.rest[dof],
                torque: data.torque[dof] - loss.torque(),
            };
            let exerted = servo.stiffness * (servo.rest - q) - servo.damping * data.v[dof] + servo.torque;
            let overshoots = exerted.abs() > limit.effort * (1.0 + EFFORT_SLACK);
            if overshoots {
                servo = Input { rest: q, ..Input::constant(limit.effort.copysign(exerted)) };
            }
            if loss.breaks_free(data.v[dof], EFFORT_SLACK) || overshoots {
                write(data, dof, servo.with(loss));
                capped = true;
            }
        }
        capped
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "a world's model, state and robot, and one substep's inputs"
    )]
    fn drive_arm(
        &mut self,
        model: &Model,
        data: &mut Data,
        handle: &RobotHandle,
        command: &Command,
        gravity: &Vec3,
        h: f64,
        remaining: f64,
    ) {
        let arm = &self.kinematics;
        let q = JointValues::from_fn(handle.arm.len(), |i| data.q[model.qs(handle.arm[i]).start]).vector();
        let holding = arm.gravity_torque(&q, gravity);
        let inertia = arm.reflected_inertia(&q);
        for i in 0..arm.dof() {
            let limit = arm.limits()[i];
            let target = &mut self.set.arm_target[i];
            let rate = &mut self.set.arm_rate[i];
            // A command that is missing or not finite does not stop the set point at once: it brakes.
            let finite = |values: &JointValues| values.get(i).copied().filter(|x| x.is_finite());
            let wanted = finite(&command.arm_q).unwrap_or(*target);
            let passing = finite(&command.arm_v).unwrap_or(0.0);
            let passing = passing.clamp(-limit.velocity, limit.velocity);
            let wanted = (wanted - passing * remaining).clamp(limit.lower, limit.upper);
            // Offset from the motion that passes the target at this speed.
            let off = wanted - passing * h - *target;
            let acceleration = self.robot.arm_acceleration;
            let (slowest, fastest) = velocity_range(*target, *rate, &limit, acceleration, h);
            let speed = passing + stopping_speed(off.abs(), acceleration, h).copysign(off);
            *rate = speed.max(slowest).min(fastest);
            *target = (*target + *rate * h).clamp(limit.lower, limit.upper);
            let dof = model.dofs(handle.arm[i]).start;
            let drivetrain = &self.robot.drivetrains[i];
            let joint = Joint { q: q[i], v: data.v[dof], inertia: inertia[i] + drivetrain.armature };
            let feed_forward = holding[i] * self.robot.gravity_share;
            let servo = self.robot.arm.input(&joint, self.set.arm_target[i], feed_forward, limit.effort, h);
            self.losses[i] = drivetrain.loss(&joint, &servo, -holding[i], h);
            write(data, dof, servo.with(&self.losses[i]));
        }
    }

    fn drive_fingers(
        &mut self,
        model: &Model,
        data: &mut Data,
        handle: &RobotHandle,
        command: &Command,
        h: f64,
    ) {
        let Some(gains) = self.robot.finger else { return };
        let asked = if command.finger_force.is_finite() { command.finger_force.max(0.0) } else { 0.0 };
        let limit = asked.min(self.robot.finger_force);
        for (i, (finger, servo)) in handle.fingers.iter().zip(&self.robot.fingers).enumerate() {
            let FingerServo { lower, upper, inertia } = *servo;
            let (dof, q) = (model.dofs(finger.drive).start, data.q[model.qs(finger.drive).start]);
            // The opening and, by virtual work, the lever that turns forces at the pad into efforts of the joint.
            let (opening, lever) = (finger.opening.at(q), finger.opening.rate(q));
            if command.finger_q.is_finite() {
                let wanted = command.finger_q.clamp(lower, upper);
                let next = toward(self.set.finger_target[i], wanted, self.robot.finger_speed * h);
                // Against an object the set point stops where it exerts the limit, so that opening is prompt.
                let reach = limit / gains.stiffness;
                self.set.finger_target[i] =
                    next.max(opening - reach).min(opening + reach).clamp(lower, upper);
            }
            let joint = Joint { q, v: data.v[dof], inertia };
            let rest = finger.opening.rest(q, self.set.finger_target[i]);
            write(data, dof, gains.on_lever(lever).input(&joint, rest, 0.0, limit * lever.abs(), h));
        }
    }
}
