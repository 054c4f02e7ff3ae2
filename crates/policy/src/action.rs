//! Actions: normalised numbers as commands of a robot.

use orchard_geometry::{Pose, Rotation, Vec3};
use orchard_robot::{ArmKinematics, BaseJoint, Command, JointValues, RobotModel, Steering};
use serde::Serialize;

use crate::rules::Scales;
use crate::spaces::Control;

mod inverse;

/// One number of an action, in [-1, 1]. The value that it stands for is linear in it; numbers beyond the ends count as the ends.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Channel {
    /// Name: a joint of the robot, `ee_*`, `base_*` or `gripper`.
    pub name: String,
    /// Unit of the value.
    pub unit: &'static str,
    /// Frame of reference in whose axes the value is; none for joints and the gripper.
    pub frame: Option<&'static str>,
    /// Value of action -1.
    pub at_minus_one: f64,
    /// Value of action 1.
    pub at_plus_one: f64,
    /// Meaning of the value, with its sign, for people.
    pub meaning: &'static str,
}

impl Channel {
    fn new(name: &str, unit: &'static str, ends: [f64; 2], meaning: &'static str) -> Self {
        let name = name.to_owned();
        Self { name, unit, frame: None, at_minus_one: ends[0], at_plus_one: ends[1], meaning }
    }

    /// A value in axes of the base frame, up to `most` either way.
    fn of_base(name: &str, unit: &'static str, most: f64, meaning: &'static str) -> Self {
        Self { frame: Some("base"), ..Self::new(name, unit, [-most, most], meaning) }
    }

    fn value(&self, action: f32) -> f64 {
        let share = 0.5 * (f64::from(action.clamp(-1.0, 1.0)) + 1.0);
        self.at_minus_one + share * (self.at_plus_one - self.at_minus_one)
    }
}

/// Turns actions into commands of a robot.
#[derive(Debug, Clone)]
pub(crate) struct Drive {
    control: Control,
    /// Those of the arm, the directions of the base, the gripper.
    pub channels: Vec<Channel>,
    arm: ArmKinematics,
    /// Largest move of each joint's set point in an action \[rad\], but for places.
    joint_moves: Vec<f64>,
    /// Steps of inverse kinematics.
    tool_steps: u32,
    /// Velocity of the base in its frame per value of each of its channels.
    base: Vec<[f64; 3]>,
    has_cup: bool,
    start: Command,
    /// Frames of an action, and their whole time \[s\].
    frames: u32,
    period: f64,
}

impl Drive {
    /// Makes the drive of a robot; an action has a number of frames, which take `period` seconds in all.
    pub fn new(robot: &RobotModel, control: Control, scales: &Scales, frames: u32, period: f64) -> Self {
        let (config, arm) = (robot.config(), robot.kinematics());
        let joint_moves: Vec<f64> =
            arm.limits().iter().map(|limit| limit.velocity * scales.joint_speed.si() * period).collect();
        let joints = config.parts.arm_joints.iter().zip(arm.limits()).zip(&joint_moves);
        let mut channels: Vec<Channel> = match control {
            Control::JointDelta => joints
                .map(|((name, _), most)| {
                    let meaning =
                        "move of the joint's set point, added to the last one, within the joint's limits";
                    Channel::new(name, "rad", [-most, *most], meaning)
                })
                .collect(),
            Control::JointAbsolute => joints
                .map(|((name, limit), _)| {
                    Channel::new(name, "rad", [limit.lower, limit.upper], "place of the joint's set point")
                })
                .collect(),
            Control::EeDelta => tool_channels(scales, period),
        };
        let mut base = Vec::new();
        if let Some(drive) = &config.drive {
            let (speed, turn) = (drive.speed_max.si(), drive.turn_speed_max.si());
            let axes: Vec<(&str, &'static str, f64, [f64; 3], &'static str)> =
                match (robot.base_joint(), &drive.steering) {
                    (BaseJoint::Fixed, _) => Vec::new(),
                    (BaseJoint::Rail { axis_base: a, .. }, _) => {
                        vec![("base_rail", "m/s", speed, [a.x, a.y, 0.0], "velocity along the rail")]
                    }
                    (BaseJoint::Planar(_), steering) => {
                        let forward =
                            ("base_forward", "m/s", speed, [1.0, 0.0, 0.0], "velocity forwards, base frame");
                        let left =
                            ("base_left", "m/s", speed, [0.0, 1.0, 0.0], "velocity to the left, base frame");
                        let turn =
                            ("base_turn", "rad/s", turn, [0.0, 0.0, 1.0], "turn rate, positive to the left");
                        match steering {
                            Steering::Holonomic => vec![forward, left, turn],
                            Steering::Differential | Steering::Ackermann { .. } => vec![forward, turn],
                        }
                    }
                };
            for (name, unit, most, direction, meaning) in axes {
                channels.push(Channel::of_base(name, unit, most, meaning));
                base.push(direction);
            }
        }
        let has_cup = robot.cup().is_some();
        channels.push(if has_cup {
            Channel::new(
                "gripper",
                "1",
                [1.0, 0.0],
                "valve of the suction cup: -1 draws the whole vacuum, 1 vents",
            )
        } else {
            let open = [0.0, arm.finger_stroke()];
            Channel::new("gripper", "m", open, "opening of each finger: -1 closes, 1 opens")
        });
        Self {
            control,
            channels,
            arm: arm.clone(),
            joint_moves,
            tool_steps: scales.tool_steps.get(),
            base,
            has_cup,
            start: robot.start_command(),
            frames,
            period,
        }
    }

    /// The arm's set points at the start of an episode \[rad\].
    pub fn start(&self) -> JointValues {
        self.start.arm_q
    }

    /// The motion of an action, one number a channel, after the set points of the last one.
    pub fn motion(&self, action: &[f32], last: &JointValues) -> Motion {
        let values: Vec<f64> = self.channels.iter().zip(action).map(|(c, &a)| c.value(a)).collect();
        let dof = self.arm.dof();
        let (of_arm, others) = values.split_at(values.len() - self.base.len() - 1);
        let to = match self.control {
            Control::JointDelta => JointValues::from_fn(dof, |i| self.limited(i, last[i] + of_arm[i])),
            Control::JointAbsolute => JointValues::from_fn(dof, |i| of_arm[i]),
            Control::EeDelta => self.tool_moved(of_arm, last),
        };
        let mut base_velocity = [0.0; 3];
        for (direction, value) in self.base.iter().zip(others) {
            for k in 0..3 {
                base_velocity[k] += direction[k] * value;
            }
        }
        let gripper = values[values.len() - 1];
        let held = match self.has_cup {
            true => Command { vacuum: gripper, ..self.start },
            false => Command { finger_q: gripper, ..self.start },
        };
        // Moves pass through their ends at an even speed; places are approached as the servos can.
        let (from, speed) = match self.control {
            Control::JointDelta | Control::EeDelta => {
                (*last, JointValues::from_fn(dof, |i| (to[i] - last[i]) / self.period))
            }
            Control::JointAbsolute => (to, JointValues::zeros(dof)),
        };
        Motion { from, to, frames: self.frames, command: Command { base_velocity, arm_v: speed, ..held } }
    }

    fn limited(&self, joint: usize, q: f64) -> f64 {
        let limit = self.arm.limits()[joint];
        q.clamp(limit.lower, limit.upper)
    }

    /// Set points that move the tool from where the last ones have it \[m\], and turn it by a rotation vector \[rad\], both in axes of the base
    /// frame. A move that a joint would take faster than its set points may move is shortened as a whole.
    fn tool_moved(&self, by: &[f64], last: &JointValues) -> JointValues {
        if by.iter().all(|x| *x == 0.0) {
            return *last;
        }
        let (along, about) = (Vec3::from_column_slice(&by[..3]), Vec3::from_column_slice(&by[3..]));
        let x_base_tcp = self.arm.tcp(&last.vector());
        let turned = Rotation::from_scaled_axis(about) * x_base_tcp.rotation;
        let to = Pose::from_parts((x_base_tcp.translation.vector + along).into(), turned);
        let q = self.arm.follow(&to, &last.vector(), self.tool_steps);
        let dof = self.arm.dof();
        let shares = (0..dof).map(|i| self.joint_moves[i] / (q[i] - last[i]).abs());
        let share = shares.fold(1.0, f64::min);
        JointValues::from_fn(dof, |i| self.limited(i, last[i] + share * (q[i] - last[i])))
    }
}

/// The channels of control `ee_delta`.
fn tool_channels(scales: &Scales, period: f64) -> Vec<Channel> {
    let (moved, turned) = (scales.tool_speed.si() * period, scales.tool_turn_speed.si() * period);
    let along = "move of the tool's set point, added to the last one";
    let about = "component of the rotation vector (axis times angle) by which the tool's set point turns: R becomes exp(r) R";
    let moves = ["ee_x", "ee_y", "ee_z"].map(|name| Channel::of_base(name, "m", moved, along));
    let turns = ["ee_rx", "ee_ry", "ee_rz"].map(|name| Channel::of_base(name, "rad", turned, about));
    moves.into_iter().chain(turns).collect()
}

/// The commands of one action.
#[derive(Debug, Clone)]
pub struct Motion {
    from: JointValues,
    to: JointValues,
    frames: u32,
    command: Command,
}

impl Motion {
    /// Set points at its end \[rad\].
    pub fn end(&self) -> JointValues {
        self.to
    }

    /// The command of a frame, counted from 0.
    pub fn command(&self, frame: u32) -> Command {
        let share = f64::from(frame + 1) / f64::from(self.frames);
        let arm_q =
            JointValues::from_fn(self.to.len(), |i| self.from[i] + share * (self.to[i] - self.from[i]));
        Command { arm_q, ..self.command }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(robot: &str, control: Control) -> Drive {
        Drive::new(&RobotModel::named(robot).unwrap(), control, &Scales::v1(), 6, 0.1)
    }

    #[test]
    fn every_robot_has_the_channels_of_its_parts() {
        let names = |robot| -> Vec<String> {
            let drive = drive(robot, Control::JointDelta);
            drive.channels[drive.arm.dof()..].iter().map(|c| c.name.clone()).collect()
        };
        assert_eq!(names("ridgeback-fr3"), ["base_forward", "base_left", "base_turn", "gripper"]);
        assert_eq!(names("husky-ur5e-2f85"), ["base_forward", "base_turn", "gripper"]);
        assert_eq!(names("rail-xarm6-suction"), ["base_rail", "gripper"]);
        assert_eq!(names("fr3-fixed"), ["gripper"]);
    }

    #[test]
    fn signs_and_ends_are_those_of_the_convention() {
        let drive = drive("ridgeback-fr3", Control::JointDelta);
        let n = drive.channels.len();
        let start = drive.start();
        let still = drive.motion(&vec![0.0; n], &start).command(5);
        assert_eq!((still.arm_q, still.base_velocity), (start, [0.0; 3]));
        let mut action = vec![0.0; n];
        (action[0], action[7], action[n - 1]) = (1.0, -1.0, 1.0);
        let motion = drive.motion(&action, &start);
        let limit = drive.arm.limits()[0];
        // Half the joint's speed for a tenth of a second, passed at that speed.
        assert!((motion.to[0] - start[0] - 0.05 * limit.velocity).abs() < 1e-12);
        let (first, last) = (motion.command(0), motion.command(5));
        assert!((first.arm_q[0] - start[0] - (motion.to[0] - start[0]) / 6.0).abs() < 1e-12);
        assert!((last.arm_q[0] - motion.to[0]).abs() < 1e-12);
        assert!((last.arm_v[0] - 0.5 * limit.velocity).abs() < 1e-12);
        assert!(last.base_velocity[0] < 0.0 && last.finger_q == drive.arm.finger_stroke());
        action[n - 1] = -3.0;
        assert_eq!(drive.motion(&action, &start).command(0).finger_q, 0.0);
    }

    #[test]
    fn absolute_actions_span_the_joints_and_moves_end_at_their_limits() {
        let absolute = drive("ridgeback-fr3", Control::JointAbsolute);
        let n = absolute.channels.len();
        let motion = absolute.motion(&vec![1.0; n], &absolute.start());
        for (q, limit) in motion.to.iter().zip(absolute.arm.limits()) {
            assert!((q - limit.upper).abs() < 1e-12);
        }
        let delta = drive("ridgeback-fr3", Control::JointDelta);
        let mut set = delta.start();
        for _ in 0..200 {
            set = delta.motion(&vec![1.0; n], &set).to;
        }
        for (q, limit) in set.iter().zip(delta.arm.limits()) {
            assert_eq!(*q, limit.upper);
        }
    }

    #[test]
    fn the_tool_moves_and_turns_in_axes_of_the_base() {
        let scales = Scales::v1();
        let (moved, turned) = (0.1 * scales.tool_speed.si(), 0.1 * scales.tool_turn_speed.si());
        for robot in ["ridgeback-fr3", "fr3-fixed", "rail-xarm6-suction", "husky-ur5e-2f85"] {
            let drive = drive(robot, Control::EeDelta);
            let (n, start) = (drive.channels.len(), drive.start());
            assert_eq!(drive.motion(&vec![0.0; n], &start).to, start, "{robot} holds");
            let before = drive.arm.tcp(&start.vector());
            for axis in 0..6 {
                // A quarter of the whole scale, so that no joint is too slow for it.
                let mut action = vec![0.0; n];
                action[axis] = 0.25;
                let after = drive.arm.tcp(&drive.motion(&action, &start).to.vector());
                let (mut p, mut r) = (Vec3::zeros(), Vec3::zeros());
                if axis < 3 {
                    p[axis] = 0.25 * moved;
                } else {
                    r[axis - 3] = 0.25 * turned;
                }
                let p_error = after.translation.vector - before.translation.vector - p;
                let r_error = (after.rotation * before.rotation.inverse()).scaled_axis() - r;
                assert!(
                    p_error.norm() < 1e-5 && r_error.norm() < 1e-5,
                    "{robot} {axis}: {p_error} {r_error}"
                );
            }
        }
    }

    #[test]
    fn a_tool_beyond_reach_leaves_the_joints_within_limits_and_speeds() {
        for robot in ["ridgeback-fr3", "fr3-fixed", "rail-xarm6-suction", "husky-ur5e-2f85"] {
            let drive = drive(robot, Control::EeDelta);
            let n = drive.channels.len();
            for signs in 0..64_u32 {
                let mut set = drive.start();
                let action: Vec<f32> =
                    (0..n).map(|i| if signs >> (i % 6) & 1 == 0 { 1.0 } else { -1.0 }).collect();
                for _ in 0..40 {
                    let next = drive.motion(&action, &set).to;
                    for i in 0..next.len() {
                        let limit = drive.arm.limits()[i];
                        assert!((limit.lower..=limit.upper).contains(&next[i]), "{robot} {i}: {}", next[i]);
                        assert!((next[i] - set[i]).abs() < drive.joint_moves[i] + 1e-12, "{robot} {i}");
                    }
                    set = next;
                }
            }
        }
    }

    #[test]
    fn a_cup_draws_where_fingers_close() {
        let drive = drive("rail-xarm6-suction", Control::JointDelta);
        let n = drive.channels.len();
        let vacuum = |a: f32| drive.motion(&vec![a; n], &drive.start()).command(0).vacuum;
        assert_eq!((vacuum(-1.0), vacuum(1.0)), (1.0, 0.0));
    }
}
