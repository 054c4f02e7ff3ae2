//! Readings of the robot's joints and drives.

use foxglove::messages::{JointState, JointStates};
use orchard_multibody::BodyId;
use orchard_robot::Observation;
use orchard_world::World;

use crate::clock::timestamp;

/// Names of the base's coordinates in the odom frame.
const BASE: [&str; 3] = ["base/x", "base/y", "base/yaw"];

/// Names of joints: those of height, arm and fingers are from the robot's description.
#[derive(Debug, Clone)]
pub struct Joints {
    height: Option<String>,
    arm: Vec<String>,
    fingers: Vec<String>,
}

impl Joints {
    /// Returns the joint names of a world's robot.
    pub fn of(world: &World) -> Self {
        let (handle, links) = (world.handle(), &world.robot().articulation().links);
        let name = |body: &BodyId| {
            let link = handle.bodies.iter().position(|own| own == body);
            link.map_or_else(String::new, |link| links[link].joint_name.clone())
        };
        Self {
            height: handle.height.as_ref().map(name),
            arm: handle.arm.iter().map(name).collect(),
            fingers: handle.fingers.iter().map(|finger| name(&finger.drive)).collect(),
        }
    }

    /// Joint states of an observation: m or rad, m/s or rad/s, N or N m; values that the observation lacks are left out. Fingers are given by their
    /// openings and forces at the pads \[m, N\], hinged ones too, under the names of their driving joints.
    pub fn message(&self, log_time: u64, seen: &Observation) -> JointStates {
        let joint = |name: &str, position: f64, velocity: Option<f64>, effort: Option<f64>| JointState {
            name: name.to_owned(),
            position: Some(position),
            velocity,
            acceleration: None,
            effort,
        };
        let mut joints: Vec<JointState> = (0..BASE.len())
            .map(|i| joint(BASE[i], seen.base_pose[i], Some(seen.base_velocity[i]), None))
            .collect();
        joints.extend(self.height.iter().map(|name| joint(name, seen.base_height, None, None)));
        joints.extend(
            self.arm
                .iter()
                .enumerate()
                .map(|(i, name)| joint(name, seen.arm_q[i], Some(seen.arm_v[i]), Some(seen.arm_torque[i]))),
        );
        let finger =
            |(i, name): (usize, &String)| joint(name, seen.finger_q[i], None, Some(seen.finger_force[i]));
        joints.extend(self.fingers.iter().enumerate().map(finger));
        JointStates { timestamp: Some(timestamp(log_time)), joints }
    }
}
