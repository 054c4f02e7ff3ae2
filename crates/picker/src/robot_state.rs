//! State of the robot from its sensors, in the frames of the picker.

use crate::config::SensorsConfig;
use orchard_geometry::{Pose, Rotation, Vec3, math};
use orchard_robot::{BaseMotion, JointVector, Observation};
use std::collections::VecDeque;

/// Pose and joint state at one control frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RobotState {
    pub time: f64,
    /// Time since the last frame \[s\].
    pub dt: f64,
    pub q: JointVector,
    pub v: JointVector,
    /// Mean acceleration of the joints since the last frame [rad/s2].
    pub a: JointVector,
    pub torque: JointVector,
    /// Distance between the pads \[m\].
    pub width: f64,
    pub finger_q: [f64; 2],
    /// Forces of the finger drives, positive opening \[N\].
    pub finger_force: [f64; 2],
    /// Vacuum in the suction cup \[Pa\]; 0 without a cup.
    pub vacuum: f64,
    pub x_odom_base: Pose,
    /// x, y, yaw in odom.
    pub base_pose: [f64; 3],
    /// Speed of the base [m/s].
    pub base_speed: f64,
    /// Turn rate of the base [rad/s].
    pub turn_speed: f64,
    /// Velocity of the base in odom [m/s, m/s, rad/s].
    pub base_velocity: [f64; 3],
    /// Mean acceleration of the base since the last frame, odom [m/s2, m/s2, rad/s2].
    pub base_acceleration: [f64; 3],
}

impl RobotState {
    /// Reads an observation. Returns `None` if a reading is not finite.
    pub fn read(observation: &Observation, last_time: Option<f64>, config: &SensorsConfig) -> Option<Self> {
        let o = observation;
        let all = [o.time, o.base_height, o.cup_pressure];
        let numbers = all
            .iter()
            .chain(&o.arm_q)
            .chain(&o.arm_v)
            .chain(&o.arm_torque)
            .chain(&o.finger_q)
            .chain(&o.finger_force)
            .chain(&o.base_pose)
            .chain(&o.base_velocity);
        if !numbers.into_iter().all(|x| x.is_finite()) {
            return None;
        }
        Some(Self {
            time: o.time,
            dt: last_time.map_or(0.0, |t| (o.time - t).clamp(0.0, config.longest_step.si())),
            q: o.arm_q.vector(),
            v: o.arm_v.vector(),
            a: JointVector::zeros(),
            torque: o.arm_torque.vector(),
            width: o.finger_q[0] + o.finger_q[1],
            finger_q: o.finger_q,
            finger_force: o.finger_force,
            vacuum: -o.cup_pressure,
            x_odom_base: o.x_odom_base(),
            base_pose: o.base_pose,
            base_speed: math::hypot(o.base_velocity[0], o.base_velocity[1]),
            turn_speed: o.base_velocity[2].abs(),
            base_velocity: o.base_velocity,
            base_acceleration: [0.0; 3],
        })
    }

    /// A robot that stands still at the origin, its hand closed on nothing.
    #[cfg(test)]
    pub fn still(time: f64) -> Self {
        Self {
            time,
            dt: 0.0,
            q: JointVector::zeros(),
            v: JointVector::zeros(),
            a: JointVector::zeros(),
            torque: JointVector::zeros(),
            width: 0.0,
            finger_q: [0.0; 2],
            finger_force: [0.0; 2],
            vacuum: 0.0,
            x_odom_base: Pose::identity(),
            base_pose: [0.0; 3],
            base_speed: 0.0,
            turn_speed: 0.0,
            base_velocity: [0.0; 3],
            base_acceleration: [0.0; 3],
        }
    }

    /// Adds the mean accelerations since the state of the last frame.
    pub fn accelerate_from(&mut self, last: &Self) {
        if self.dt > 0.0 {
            self.a = (self.v - last.v) / self.dt;
            self.base_acceleration =
                std::array::from_fn(|k| (self.base_velocity[k] - last.base_velocity[k]) / self.dt);
        }
    }

    /// Places the base at x, y, yaw in odom.
    pub fn place_base(&mut self, pose: [f64; 3]) {
        let [x, y, yaw] = pose;
        let p = Vec3::new(x, y, self.x_odom_base.translation.z);
        let turn = Rotation::from_axis_angle(&Vec3::z_axis(), yaw);
        (self.base_pose, self.x_odom_base) = (pose, Pose::from_parts(p.into(), turn));
    }

    /// Expresses pose and velocity of the base in another frame: `by` is the pose of odom in it (x, y, yaw).
    pub fn move_odom(&mut self, by: &[f64; 3]) {
        let [x, y, yaw] = self.base_pose;
        let [x, y] = turned([x, y], by[2]);
        self.place_base([by[0] + x, by[1] + y, by[2] + yaw]);
        let [vx, vy, rate] = self.base_velocity;
        let [vx, vy] = turned([vx, vy], by[2]);
        self.base_velocity = [vx, vy, rate];
    }

    /// Motion of the base in its own axes.
    pub fn base_motion(&self) -> BaseMotion {
        let [x, y, turn] = self.base_acceleration;
        BaseMotion {
            acceleration: self.x_odom_base.rotation.inverse() * Vec3::new(x, y, 0.0),
            angular_velocity: Vec3::z() * self.base_velocity[2],
            angular_acceleration: Vec3::z() * turn,
        }
    }

    /// Position of the base on the ground, odom \[m\].
    pub fn p_odom(&self) -> Vec3 {
        Vec3::new(self.base_pose[0], self.base_pose[1], 0.0)
    }
}

/// A vector of the plane turned by an angle \[rad\].
pub(crate) fn turned([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = math::sin_cos(angle);
    [cos * x - sin * y, sin * x + cos * y]
}

/// States of the last moments, to place images that come late.
#[derive(Debug, Clone)]
pub(crate) struct Memory {
    states: VecDeque<RobotState>,
    /// Time that the memory reaches back \[s\].
    span: f64,
    /// Largest time between an image and the state used for it \[s\].
    gap: f64,
}

impl Memory {
    /// Makes an empty memory.
    pub fn new(config: &SensorsConfig) -> Self {
        Self { states: VecDeque::new(), span: config.memory.si(), gap: config.longest_step.si() }
    }

    /// Adds the newest state and drops states that are too old or have a later time.
    pub fn keep(&mut self, now: &RobotState) {
        let span = now.time - self.span..now.time;
        self.states.retain(|state| span.contains(&state.time));
        self.states.push_back(now.clone());
    }

    /// Newest state.
    pub fn last(&self) -> Option<&RobotState> {
        self.states.back()
    }

    /// State nearest to a time \[s\], the newest of two; `None` if there is none near that time.
    pub fn at(&self, time: f64) -> Option<&RobotState> {
        let off = |state: &RobotState| (state.time - time).abs();
        let nearest = self.states.iter().rev().min_by(|a, b| off(a).total_cmp(&off(b)))?;
        (off(nearest) <= self.gap).then_some(nearest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PickerConfig;

    /// Accelerations are differences of the sensed velocities; a base that is turned to the left sees one along odom's x to its right.
    #[test]
    fn accelerations_follow_from_two_states() {
        let last = RobotState { base_velocity: [0.1, 0.0, 0.2], ..RobotState::still(0.0) };
        let turn = Rotation::from_axis_angle(&Vec3::z_axis(), std::f64::consts::FRAC_PI_2);
        let mut now = RobotState {
            dt: 0.5,
            v: JointVector::from_element(2.0),
            base_velocity: [0.6, 0.0, 0.3],
            x_odom_base: Pose::from_parts(Vec3::zeros().into(), turn),
            ..RobotState::still(0.5)
        };
        now.accelerate_from(&last);
        assert_eq!(now.a, JointVector::from_element(4.0));
        let motion = now.base_motion();
        assert!((motion.acceleration - Vec3::new(0.0, -1.0, 0.0)).norm() < 1e-12, "{motion:?}");
        assert!((motion.angular_acceleration - Vec3::z() * 0.2).norm() < 1e-12, "{motion:?}");
        assert_eq!(motion.angular_velocity, Vec3::z() * 0.3);
        // The first frame, or a clock that stands: no acceleration is known.
        let mut first = RobotState { dt: 0.0, ..now.clone() };
        (first.a, first.base_acceleration) = (JointVector::zeros(), [0.0; 3]);
        first.accelerate_from(&last);
        assert_eq!((first.a, first.base_acceleration), (JointVector::zeros(), [0.0; 3]));
    }

    #[test]
    fn the_memory_holds_the_last_moments() {
        let config = PickerConfig::baseline().sensors;
        let (span, gap) = (config.memory.si(), config.longest_step.si());
        let mut memory = Memory::new(&config);
        assert_eq!(memory.at(0.0), None);
        let frame = 1.0 / 60.0;
        for k in 0..600 {
            memory.keep(&RobotState::still(f64::from(k) * frame));
        }
        let now = 599.0 * frame;
        let time = |at: f64| memory.at(at).map(|state| state.time);
        assert_eq!(time(now), Some(now));
        assert_eq!(time(now - 4.0 * frame), Some(595.0 * frame));
        assert_eq!(time(now - 4.4 * frame), Some(595.0 * frame));
        assert!(time(now - span).is_some_and(|t| (t - (now - span)).abs() <= 0.5 * frame + 1e-12));
        assert_eq!(time(now - span - 1.1 * gap), None);
        assert_eq!(time(now + 1.1 * gap), None);
        assert_eq!(time(f64::NAN), None);
        assert!(memory.states.len() as f64 <= span / frame + 1.0);
        // A clock that jumps back leaves nothing of the future.
        memory.keep(&RobotState::still(1.0));
        assert_eq!(memory.states.len(), 1);
    }
}
