//! Commands as actions: the way back from what a controller commands.

use orchard_robot::{Command, JointValues};

use super::{Channel, Drive, Motion};
use crate::spaces::Control;

impl Channel {
    /// The action whose value comes nearest to a value.
    fn action(&self, value: f64) -> f32 {
        let span = self.at_plus_one - self.at_minus_one;
        let share = if span == 0.0 { 0.5 } else { (value - self.at_minus_one) / span };
        (2.0 * share - 1.0).clamp(-1.0, 1.0) as f32
    }
}

impl Drive {
    /// The action whose motion comes nearest to commands of the first frames of a step: it ends at the last set points, carried on by their
    /// speeds to the step's end, with the mean velocity of the base and the last command of the hand. Without commands it keeps the set points.
    pub fn action(&self, commands: &[Command], last: &JointValues) -> Vec<f32> {
        let latest = commands.last().copied().unwrap_or(Command { arm_q: *last, ..self.start });
        let count = commands.len().max(1) as f64;
        let rest = f64::from(self.frames.saturating_sub(commands.len() as u32)) * self.period
            / f64::from(self.frames);
        let arm_q = JointValues::from_fn(latest.arm_q.len(), |i| latest.arm_q[i] + rest * latest.arm_v[i]);
        let mut base_velocity = [0.0; 3];
        for command in commands {
            for (sum, part) in base_velocity.iter_mut().zip(command.base_velocity) {
                *sum += part / count;
            }
        }
        let values = self.values(&Command { arm_q, base_velocity, ..latest }, last);
        self.channels.iter().zip(values).map(|(channel, value)| channel.action(value)).collect()
    }

    /// Largest difference between a motion and commands of its frames in each channel, in the channel's unit; of the arm between set points.
    pub fn error(&self, motion: &Motion, commands: &[Command]) -> Vec<f64> {
        let mut most = vec![0.0; self.channels.len()];
        for (frame, command) in (0..).zip(commands) {
            let [is, wanted] = [&motion.command(frame), command].map(|c| self.values(c, &motion.from));
            for (most, (is, wanted)) in most.iter_mut().zip(is.iter().zip(wanted)) {
                *most = f64::max(*most, (is - wanted).abs());
            }
        }
        most
    }

    /// Values of a command in each channel: set points of the arm (moves of them after the last ones, or places), velocities of the base, the hand.
    fn values(&self, command: &Command, last: &JointValues) -> Vec<f64> {
        let along = |direction: &[f64; 3]| -> f64 {
            direction.iter().zip(command.base_velocity).map(|(d, v)| d * v).sum()
        };
        let of_arm: Vec<f64> = match self.control {
            Control::JointDelta => command.arm_q.iter().zip(last).map(|(to, from)| to - from).collect(),
            Control::JointAbsolute => command.arm_q.iter().copied().collect(),
            Control::EeDelta => {
                let [from, to] = [last, &command.arm_q].map(|q| self.arm.tcp(&q.vector()));
                let moved = to.translation.vector - from.translation.vector;
                let turned = (to.rotation * from.rotation.inverse()).scaled_axis();
                moved.iter().chain(turned.iter()).copied().collect()
            }
        };
        let hand = if self.has_cup { command.vacuum } else { command.finger_q };
        of_arm.into_iter().chain(self.base.iter().map(along)).chain([hand]).collect()
    }
}

#[cfg(test)]
mod tests {
    use orchard_robot::RobotModel;

    use super::*;
    use crate::rules::Scales;

    fn drive(robot: &str, control: Control) -> Drive {
        Drive::new(&RobotModel::named(robot).unwrap(), control, &Scales::v1(), 6, 0.1)
    }

    #[test]
    fn the_commands_of_an_action_give_it_back() {
        for robot in ["ridgeback-fr3", "husky-ur5e-2f85", "rail-xarm6-suction", "fr3-fixed"] {
            for control in [Control::JointDelta, Control::JointAbsolute] {
                let drive = drive(robot, control);
                let action: Vec<f32> =
                    (0..drive.channels.len()).map(|i| ((i * 5 % 9) as f32 - 4.0) / 8.0).collect();
                let last = drive.start();
                let motion = drive.motion(&action, &last);
                let commands: Vec<Command> = (0..6).map(|frame| motion.command(frame)).collect();
                assert!(drive.error(&motion, &commands).iter().all(|e| *e == 0.0));
                // A part of the step is enough, since the set points move on at their speed.
                for known in [1, 4, 6] {
                    let back = drive.action(&commands[..known], &last);
                    for ((channel, a), b) in drive.channels.iter().zip(&action).zip(&back) {
                        assert!((a - b).abs() < 1e-6, "{robot} {}: {a} {b}", channel.name);
                    }
                }
            }
        }
    }

    /// A small move of the tool comes back to a thousandth of the largest one: the joints follow it by a few steps of least squares.
    #[test]
    fn the_commands_of_a_move_of_the_tool_give_it_back() {
        for robot in ["ridgeback-fr3", "husky-ur5e-2f85", "rail-xarm6-suction", "fr3-fixed"] {
            let drive = drive(robot, Control::EeDelta);
            let mut action = vec![0.0; drive.channels.len()];
            action[..6].copy_from_slice(&[0.1, -0.05, 0.08, 0.05, 0.02, -0.06]);
            let last = drive.start();
            let motion = drive.motion(&action, &last);
            let commands: Vec<Command> = (0..6).map(|frame| motion.command(frame)).collect();
            for (channel, (a, b)) in
                drive.channels.iter().zip(action.iter().zip(drive.action(&commands, &last)))
            {
                assert!((a - b).abs() < 1e-3, "{robot} {}: {a} {b}", channel.name);
            }
        }
    }

    #[test]
    fn what_an_action_cannot_say_is_its_error() {
        let drive = drive("ridgeback-fr3", Control::JointDelta);
        let (last, hold) = (drive.start(), drive.start);
        let mut far = hold;
        // Ten times as far as an action moves a joint, and a base that turns in one frame of two.
        let most = drive.channels[0].at_plus_one;
        far.arm_q[0] += 10.0 * most;
        far.base_velocity[2] = 0.4;
        let action = drive.action(&[hold, far], &last);
        assert_eq!(action[0], 1.0);
        let motion = drive.motion(&action, &last);
        let error = drive.error(&motion, &[hold, far]);
        assert!((error[0] - (10.0 - 2.0 / 6.0) * most).abs() < 1e-9, "{error:?}");
        let turn = drive.channels.iter().position(|channel| channel.name == "base_turn").unwrap();
        assert!((error[turn] - 0.2).abs() < 1e-6, "{error:?}");
        // Without a command the set points stay.
        let still = drive.motion(&drive.action(&[], &last), &last).command(5);
        assert!((still.arm_q[0] - last[0]).abs() < 1e-6 && still.base_velocity == [0.0; 3]);
    }
}
