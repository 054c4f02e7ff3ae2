//! Observations and commands of a controller. Neither can carry a pose or a label of the world.

use crate::joint_values::JointValues;
use crate::pictures::Pictures;
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Rotation, Vec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Joint sensors, wheel odometry and the depth camera at one control frame.
#[derive(Debug, Clone)]
pub struct Observation {
    /// Time since the episode began \[s\].
    pub time: f64,
    /// Arm joint positions \[rad\].
    pub arm_q: JointValues,
    /// Arm joint velocities [rad/s].
    pub arm_v: JointValues,
    /// Torques behind the gears of the arm [N m]: what the servos exert, gravity compensation included, less what rotors and friction take.
    pub arm_torque: JointValues,
    /// Openings of the fingers \[m\], 0 closed: distance of each pad from the plane midway between the pads.
    pub finger_q: [f64; 2],
    /// Forces that the finger drives exert \[N\], positive opening.
    pub finger_force: [f64; 2],
    /// Pressure in the suction cup above that of the air \[Pa\], so negative under vacuum; 0 without a cup.
    pub cup_pressure: f64,
    /// Base pose in the odom frame: x \[m\], y \[m\], yaw \[rad\].
    pub base_pose: [f64; 3],
    /// Height of the base above its rest on flat ground \[m\].
    pub base_height: f64,
    /// Base velocity in the odom frame [m/s, m/s, rad/s].
    pub base_velocity: [f64; 3],
    /// Depth image \[m\], in frames in which the camera delivers one.
    pub depth: Option<DepthImage>,
    /// Colour (sRGB) that the camera took with the depth image, registered to it and of its size, if the controller's detector looks at colour.
    pub colour: Option<Arc<Image<[u8; 3]>>>,
    /// Time at which the image was taken, on the clock of `time` \[s\]; meaningless without an image.
    pub depth_time: f64,
    /// Intrinsics of the depth image.
    pub intrinsics: Intrinsics,
    /// Colour pictures, in frames in which they are taken, if the controller asks for them.
    pub pictures: Option<Arc<Pictures>>,
}

impl Observation {
    /// Pose of the base in odom, by odometry.
    pub fn x_odom_base(&self) -> Pose {
        let [x, y, yaw] = self.base_pose;
        let turn = Rotation::from_axis_angle(&Vec3::z_axis(), yaw);
        Pose::from_parts(Vec3::new(x, y, self.base_height).into(), turn)
    }
}

/// Set point of the chassis' height above its rest, in a frame whose ground is known before.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Climb {
    /// In the last substep \[m\].
    pub height: f64,
    /// Rate at which it rises [m/s].
    pub rate: f64,
}

/// Command of a controller, valid until its next one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// Arm joint targets: positions of the set points at the end of the frame \[rad\].
    pub arm_q: JointValues,
    /// Velocities of the set points at the end of the frame [rad/s]; 0 to come to rest.
    pub arm_v: JointValues,
    /// Base velocity in the base frame: forward [m/s], left [m/s], yaw rate [rad/s].
    pub base_velocity: [f64; 3],
    /// Opening of each finger \[m\], 0 closed, [`crate::ArmKinematics::finger_stroke`] open.
    pub finger_q: f64,
    /// Largest force of each finger drive at the pad \[N\].
    pub finger_force: f64,
    /// Opening of the valve between pump and suction cup: 0 vents the cup, 1 applies the whole vacuum. Without effect without a cup.
    pub vacuum: f64,
}

impl Command {
    /// Commands no motion: the arm's set points stay where its joints are, base and fingers are not driven.
    pub fn still(observation: &Observation) -> Self {
        Self {
            arm_q: observation.arm_q,
            arm_v: JointValues::zeros(observation.arm_q.len()),
            base_velocity: [0.0; 3],
            finger_q: observation.finger_q[0],
            finger_force: 0.0,
            vacuum: 0.0,
        }
    }
}
