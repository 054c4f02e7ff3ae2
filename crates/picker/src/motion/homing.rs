//! Homing: motion of the hand onto a fruit, sideways first, then straight along the approach; the goal may be corrected meanwhile.
//!
//! Each frame's joint velocities are a quadratic program ([`ArmKinematics::velocity_step`]): they follow the hand's wanted
//! velocity within the joints' limits, with the links clear of each other and of seen obstacles.

use crate::motion::stopping_speed;
use crate::section::section;
use nalgebra::Vector6;
use orchard_geometry::{Pose, Vec3};
use orchard_quantity::{Count, Quantity};
use orchard_robot::{ArmKinematics, JointVector, Obstacle, QpGoal, QpState, QpStatus, QpTask};

/// Distance \[m\] and angle \[rad\] from the goal at which the hand has arrived: a fiftieth of the fruit's radius at the fingertips' lever.
const ARRIVED: f64 = 1e-3;
const TURNED: f64 = 0.02;

section! {
    /// Homing of the hand onto the fruit.
    HomingConfig {
        /// Largest speed along the approach.
        speed: Quantity,
        /// Largest speed across it.
        lateral_speed: Quantity,
        /// Error across the approach below which the hand advances at full speed.
        lateral_tolerance: Quantity,
        /// Largest acceleration.
        acceleration: Quantity,
        /// Length of the last stretch, straight along the approach.
        straight: Quantity,
        /// Gain of the correction of the hand's orientation.
        turn_gain: Quantity,
        /// Distance of the links from seen points outside the hand's straight path.
        clearance: Quantity,
        /// Penalty for coming nearer to leaves: lag of the hand behind its speed [m/s] at which a point yields.
        clearance_cost: Quantity,
        /// Penalty for coming nearer to wood, in the same unit.
        wood_cost: Quantity,
        /// Edge of the cubes in which points count once.
        clearance_grid: Quantity,
        /// Distance from the hand or the fruit within which points count.
        clearance_range: Quantity,
        /// Time without progress after which the motion ends.
        patience: Quantity,
        /// Push against the hand that ends the advance; the hand slows down in proportion to the push.
        push_max: Quantity,
        /// Weight of a frame's push in the running mean.
        push_weight: Quantity,
        /// Number of points in the hand's path that halves its speed.
        crowd: Quantity,
        /// Share of the speeds among branches after a contact and on further tries.
        careful: Quantity,
        /// Least speed against a push, as a share of the speeds.
        pace_min: Quantity,
        /// Least angle between a blocked direction and the next one.
        other_angle: Quantity,
        /// Largest turn of the approach, at the look posture, that clears the fingers of other fruit.
        clear_angle: Quantity,
        /// Distance from a picked fruit within which a fruit that was hemmed in is tried again.
        freed: Quantity,
        /// Number of tries at one target.
        tries: Count,
    }
}

/// Least share of the wanted motion that counts as progress.
const FOLLOWED: f64 = 0.25;

/// State of a motion to a pose of the TCP, base frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Homing {
    x_goal: Pose,
    config: HomingConfig,
    obstacles: Vec<Obstacle>,
    /// Velocity of the TCP [m/s], and of the joints [rad/s].
    v_tcp: Vec3,
    v: JointVector,
    /// Share of the speeds.
    pace: f64,
    /// Time without progress \[s\].
    idle: f64,
    over: bool,
}

impl Homing {
    /// Starts at a posture `q` \[rad\] with joint velocities `v` [rad/s].
    pub fn new(
        x_goal: Pose,
        obstacles: Vec<Obstacle>,
        (q, v): (&JointVector, JointVector),
        arm: &ArmKinematics,
        config: &HomingConfig,
    ) -> Self {
        let twist = arm.jacobian(q) * v;
        Self {
            x_goal,
            config: config.clone(),
            obstacles,
            v_tcp: twist.fixed_rows::<3>(3).into_owned(),
            v,
            pace: 1.0,
            idle: 0.0,
            over: false,
        }
    }

    pub fn correct(&mut self, x_goal: Pose, obstacles: Vec<Obstacle>) {
        self.aim(x_goal);
        self.obstacles = obstacles;
    }

    pub fn aim(&mut self, x_goal: Pose) {
        self.x_goal = x_goal;
    }

    pub fn set_pace(&mut self, pace: f64) {
        self.pace = pace;
    }

    pub fn is_over(&self) -> bool {
        self.over
    }

    /// Returns the posture after `dt` \[s\]; `None` if the motion cannot go on.
    pub fn step(&mut self, arm: &ArmKinematics, q: &JointVector, dt: f64) -> Option<JointVector> {
        if dt <= 0.0 {
            return Some(*q);
        }
        let x = arm.tcp(q);
        let left = self.x_goal.translation.vector - x.translation.vector;
        let wanted = self.wanted(&left, dt);
        let turn_left = (self.x_goal.rotation * x.rotation.inverse()).scaled_axis();
        let turn = turn_left * self.config.turn_gain.si();
        let twist = Vector6::new(turn.x, turn.y, turn.z, wanted.x, wanted.y, wanted.z);
        let goal = QpGoal { task: QpTask::Twist(twist), posture: arm.home(), held: None };
        let step = arm.velocity_step(&QpState { q: *q, v: self.v }, &goal, &self.obstacles, dt);
        if step.status == QpStatus::NotFinite {
            return None;
        }
        let p_next = arm.tcp(&step.q_next).translation.vector;
        self.v = step.v;
        // Motion that the arm could not follow is not made up for later.
        self.v_tcp = (p_next - x.translation.vector) / dt;
        let left_next = self.x_goal.translation.vector - p_next;
        let is_there = left_next.norm() <= ARRIVED;
        self.over = is_there && turn_left.norm() <= TURNED;
        let followed = !is_there && left.norm() - left_next.norm() >= FOLLOWED * wanted.norm() * dt;
        self.idle = if followed || self.over { 0.0 } else { self.idle + dt };
        (self.idle <= self.config.patience.si()).then_some(step.q_next)
    }

    /// Wanted velocity of the TCP [m/s] at a displacement `left` from the goal \[m\].
    fn wanted(&self, left: &Vec3, dt: f64) -> Vec3 {
        let c = &self.config;
        let acceleration = c.acceleration.si();
        let z = self.x_goal.rotation * Vec3::z();
        let along = left.dot(&z);
        let lateral = left - z * along;
        let stop = |distance: f64| stopping_speed(acceleration, distance, dt);
        let off = lateral.norm();
        let sideways = (c.lateral_speed.si() * self.pace).min(stop(off));
        let mut forward = (c.speed.si() * self.pace).min(stop(along.abs())) * along.signum();
        if off > c.lateral_tolerance.si() {
            // The rest before the straight stretch takes as long as the sideways motion.
            let time = off / (c.lateral_speed.si() * self.pace);
            forward = forward.min((along - c.straight.si()).max(0.0) / time);
        }
        let aside = if off > 0.0 { lateral * (sideways / off) } else { Vec3::zeros() };
        self.v_tcp + (z * forward + aside - self.v_tcp).cap_magnitude(acceleration * dt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;
    use orchard_robot::RobotModel;

    /// From beside the line the hand comes onto it before the straight stretch, then arrives.
    #[test]
    fn the_last_stretch_is_straight() {
        let (robot, config) = (RobotModel::paper(), ExpertConfig::preset());
        let arm = robot.kinematics();
        let mut q = arm.home();
        let x_start = arm.tcp(&q);
        let offset = x_start.rotation * Vec3::new(0.03, -0.02, 0.22);
        let x_goal = Pose::from_parts((x_start.translation.vector + offset).into(), x_start.rotation);
        let c = &config.homing;
        let mut homing = Homing::new(x_goal, Vec::new(), (&q, JointVector::zeros()), arm, c);
        let z = x_goal.rotation * Vec3::z();
        let (dt, mut frames) = (1.0 / 60.0, 0);
        while !homing.is_over() && frames < 600 {
            q = homing.step(arm, &q, dt).expect("within reach");
            frames += 1;
            let left = x_goal.translation.vector - arm.tcp(&q).translation.vector;
            let along = left.dot(&z);
            // The hand brakes over a few frames after it has come onto the line.
            if along < 0.8 * c.straight.si() {
                assert!((left - z * along).norm() <= 2.0 * c.lateral_tolerance.si(), "{along} {left}");
            }
        }
        // A trapezoid over the way at both speeds, and the way sideways at worst before it.
        assert!(homing.is_over() && f64::from(frames) * dt < 2.0, "{frames}");
        assert!((arm.tcp(&q).translation.vector - x_goal.translation.vector).norm() < 2.0 * ARRIVED);
        assert!(arm.tcp(&q).rotation.angle_to(&x_goal.rotation) <= TURNED);
    }

    /// Towards a goal beyond the arm's reach the way is lost after its patience; a frame of no length changes nothing.
    #[test]
    fn a_goal_out_of_reach_is_given_up() {
        let (robot, config) = (RobotModel::paper(), ExpertConfig::preset());
        let arm = robot.kinematics();
        let mut q = arm.home();
        let x_start = arm.tcp(&q);
        let p_far = x_start.translation.vector + Vec3::x() * 2.0;
        let mut homing = Homing::new(
            Pose::from_parts(p_far.into(), x_start.rotation),
            Vec::new(),
            (&q, JointVector::zeros()),
            arm,
            &config.homing,
        );
        assert_eq!(homing.step(arm, &q, 0.0), Some(q));
        let mut frames = 0;
        while let Some(next) = homing.step(arm, &q, 1.0 / 60.0) {
            for (q, limit) in next.iter().zip(arm.limits()) {
                assert!(*q >= limit.lower && *q <= limit.upper);
            }
            (q, frames) = (next, frames + 1);
            assert!(frames < 600, "still going");
        }
        // It went as far as it could first.
        assert!((arm.tcp(&q).translation.vector - x_start.translation.vector).norm() > 0.2);
    }
}
