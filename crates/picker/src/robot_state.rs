//! The robot as its sensors tell it, in the frames that the picker thinks in.

use crate::config::SensorsConfig;
use orchard_geometry::{Pose, Rotation, Vec3};
use orchard_robot::{JointVector, Observation};

/// Pose and joints at one control frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RobotState {
    pub time: f64,
    /// Since the last frame [s].
    pub dt: f64,
    pub q: JointVector,
    pub v: JointVector,
    pub torque: JointVector,
    /// Distance between the pads [m].
    pub width: f64,
    pub x_odom_base: Pose,
    /// x, y, yaw in odom.
    pub base_pose: [f64; 3],
    /// Speed of the base [m/s].
    pub base_speed: f64,
    /// Turn rate of the base [rad/s].
    pub turn_speed: f64,
}

impl RobotState {
    /// `None` if a sensor reads what is no number.
    pub fn read(observation: &Observation, last_time: Option<f64>, config: &SensorsConfig) -> Option<Self> {
        let o = observation;
        let all = [o.time, o.base_height];
        let numbers = all
            .iter()
            .chain(&o.arm_q)
            .chain(&o.arm_v)
            .chain(&o.arm_torque)
            .chain(&o.finger_q)
            .chain(&o.base_pose)
            .chain(&o.base_velocity);
        if !numbers.into_iter().all(|x| x.is_finite()) {
            return None;
        }
        let [x, y, yaw] = o.base_pose;
        let turn = Rotation::from_axis_angle(&Vec3::z_axis(), yaw);
        Some(Self {
            time: o.time,
            dt: last_time.map_or(0.0, |t| (o.time - t).clamp(0.0, config.longest_step.si())),
            q: JointVector::from(o.arm_q),
            v: JointVector::from(o.arm_v),
            torque: JointVector::from(o.arm_torque),
            width: o.finger_q[0] + o.finger_q[1],
            x_odom_base: Pose::from_parts(Vec3::new(x, y, o.base_height).into(), turn),
            base_pose: o.base_pose,
            base_speed: orchard_geometry::math::hypot(o.base_velocity[0], o.base_velocity[1]),
            turn_speed: o.base_velocity[2].abs(),
        })
    }

    /// Where the base stands, odom.
    pub fn p_odom(&self) -> Vec3 {
        Vec3::new(self.base_pose[0], self.base_pose[1], 0.0)
    }
}
