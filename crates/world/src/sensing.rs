//! Errors of the robot's odometry and joint sensors, and commands on their way to it.

use std::collections::VecDeque;

use orchard_geometry::{Pose, Rotation, Vec3, math};
use orchard_robot::{BaseJoint, Command, JointValues, Observation, RobotHandle, RobotModel};
use orchard_spec::sensing::SensingSpec;
use orchard_spec::{Purpose, Spec, Stream};
use serde::{Deserialize, Serialize};

/// Sensors of one world's robot: their figures, and the errors that are constant for the world.
#[derive(Debug, Clone)]
pub(crate) struct Sensing {
    seed: u64,
    world: u32,
    spec: SensingSpec,
    /// Relative errors of distances and of turns.
    slip: [f64; 2],
    /// Errors of joint positions \[rad\].
    offsets: JointValues,
    /// True for a base that can turn.
    turns: bool,
    /// Frames from a command to the robot that obeys it.
    command_delay: usize,
}

/// Pose of the base in the odom frame by its motion and by its wheels: x \[m\], y \[m\], yaw \[rad\].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Odometry {
    exact: [f64; 3],
    measured: [f64; 3],
}

impl Odometry {
    /// At the start of an episode.
    pub fn at(pose: [f64; 3]) -> Self {
        Self { exact: pose, measured: pose }
    }

    /// Pose in the odom frame in which the base is of the frame in which the wheels say that it is: identity without errors.
    pub fn drift(&self) -> Pose {
        if self.exact == self.measured {
            Pose::identity()
        } else {
            pose(self.exact) * pose(self.measured).inverse()
        }
    }
}

fn pose([x, y, yaw]: [f64; 3]) -> Pose {
    Pose::from_parts(Vec3::new(x, y, 0.0).into(), Rotation::from_axis_angle(&Vec3::z_axis(), yaw))
}

fn turned([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = math::sin_cos(angle);
    [cos * x - sin * y, sin * x + cos * y]
}

impl Sensing {
    /// The sensors of a world; `None` if they are exact and without delay.
    pub fn new(spec: &Spec, handle: &RobotHandle, seed: u64, world: u32) -> Option<Self> {
        let turns = matches!(handle.base_joint, BaseJoint::Planar(_));
        let frame_rate = spec.sim.frame_rate.si();
        Some(Self::of(spec.sensing.clone()?, handle.arm.len(), turns, frame_rate, seed, world))
    }

    fn of(spec: SensingSpec, arm: usize, turns: bool, frame_rate: f64, seed: u64, world: u32) -> Self {
        let mut slips = Stream::new(seed, world, Purpose::WheelSlip);
        let mut offsets = Stream::new(seed, world, Purpose::JointOffset);
        Self {
            seed,
            world,
            slip: [&spec.odometry.distance_slip, &spec.odometry.turn_slip]
                .map(|sd| slips.normal(0.0, sd.si())),
            offsets: JointValues::from_fn(arm, |_| offsets.normal(0.0, spec.joints.offset.si())),
            turns,
            command_delay: (frame_rate * spec.command_delay.si()).round() as usize,
            spec,
        }
    }

    /// The commands that are on their way at the start of an episode: the robot stands.
    pub fn first_commands(&self, robot: &RobotModel) -> VecDeque<Command> {
        std::iter::repeat_n(robot.start_command(), self.command_delay).collect()
    }

    /// True if commands could be on their way to this robot.
    pub fn fits(&self, commands: &VecDeque<Command>) -> bool {
        let arm = self.offsets.len();
        commands.len() == self.command_delay
            && commands.iter().all(|c| [c.arm_q.len(), c.arm_v.len()] == [arm, arm])
    }

    /// Ends a frame: the wheels measure the way to the base's new pose.
    pub fn travel(&self, odometry: &mut Odometry, exact: [f64; 3], frame: u32) {
        let spec = &self.spec.odometry;
        let errors = [&spec.distance_slip, &spec.turn_slip, &spec.distance_noise, &spec.heading_noise];
        if errors.iter().all(|error| error.si() == 0.0) {
            *odometry = Odometry::at(exact);
            return;
        }
        let before = std::mem::replace(&mut odometry.exact, exact);
        let [x, y, turn] = std::array::from_fn(|k| exact[k] - before[k]);
        let way = math::hypot(x, y);
        let root = way.sqrt();
        let mut noise = Stream::of_frame(self.seed, self.world, frame, Purpose::OdometryNoise);
        let [along, heading] =
            [&spec.distance_noise, &spec.heading_noise].map(|sd| noise.normal(0.0, sd.si()));
        if way > 0.0 {
            let longer = 1.0 + self.slip[0] + along * root / way;
            let by_wheels = turned([x * longer, y * longer], odometry.measured[2] - before[2]);
            odometry.measured[0] += by_wheels[0];
            odometry.measured[1] += by_wheels[1];
        }
        if self.turns {
            odometry.measured[2] += turn * (1.0 + self.slip[1]) + heading * root;
        }
    }

    /// Readings of the sensors in a frame instead of the exact ones. Velocities of the base have the slips without the noise.
    pub fn read(&self, exact: Observation, odometry: &Odometry, frame: u32) -> Observation {
        let joints = &self.spec.joints;
        let mut noise = Stream::of_frame(self.seed, self.world, frame, Purpose::JointNoise);
        let mut read = exact;
        for i in 0..read.arm_q.len() {
            read.arm_q[i] += self.offsets[i] + noise.normal(0.0, joints.noise.si());
            read.arm_v[i] += noise.normal(0.0, joints.rate_noise.si());
            read.arm_torque[i] += noise.normal(0.0, joints.torque_noise.si());
        }
        let drift = odometry.measured[2] - odometry.exact[2];
        read.base_pose = odometry.measured;
        let [x, y, turn] = read.base_velocity;
        let [x, y] = turned([x, y], drift).map(|v| v * (1.0 + self.slip[0]));
        read.base_velocity = [x, y, turn * (1.0 + self.slip[1])];
        read
    }
}

#[cfg(test)]
#[path = "sensing_tests.rs"]
mod tests;
