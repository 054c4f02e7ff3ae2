//! Commands, with all their bits.

use orchard_robot::{Command, JointValues, TooManyJoints};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::exact::Exact;

/// Command to the robot in a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CommandMessage {
    /// Set points of the arm joints at the end of the frame (rad).
    #[schemars(with = "Vec<f64>")]
    arm_q: Vec<Exact>,
    /// Velocities with which they are to pass there (rad/s).
    #[schemars(with = "Vec<f64>")]
    arm_v: Vec<Exact>,
    /// Velocity of the base in its own frame: forward (m/s), left (m/s), yaw rate (rad/s).
    #[schemars(with = "[f64; 3]")]
    base_velocity: [Exact; 3],
    /// Opening of each finger (m).
    #[schemars(with = "f64")]
    finger_q: Exact,
    /// Largest force of each finger drive (N).
    #[schemars(with = "f64")]
    finger_force: Exact,
    /// Opening of the valve of a suction cup, 0 to 1; recordings without it have 0.
    #[serde(default = "vented")]
    #[schemars(with = "f64")]
    vacuum: Exact,
}

fn vented() -> Exact {
    Exact(0.0)
}

impl From<&Command> for CommandMessage {
    fn from(command: &Command) -> Self {
        Self {
            arm_q: exact(&command.arm_q),
            arm_v: exact(&command.arm_v),
            base_velocity: command.base_velocity.map(Exact),
            finger_q: Exact(command.finger_q),
            finger_force: Exact(command.finger_force),
            vacuum: Exact(command.vacuum),
        }
    }
}

fn exact(values: &JointValues) -> Vec<Exact> {
    values.iter().map(|x| Exact(*x)).collect()
}

impl TryFrom<&CommandMessage> for Command {
    type Error = TooManyJoints;

    fn try_from(message: &CommandMessage) -> Result<Self, TooManyJoints> {
        let values = |numbers: &[Exact]| numbers.iter().map(|x| x.0).collect::<Vec<_>>().try_into();
        Ok(Self {
            arm_q: values(&message.arm_q)?,
            arm_v: values(&message.arm_v)?,
            base_velocity: message.base_velocity.map(|x| x.0),
            finger_q: message.finger_q.0,
            finger_force: message.finger_force.0,
            vacuum: message.vacuum.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_comes_back_with_all_its_bits() {
        let command = Command {
            arm_q: [0.1, -0.0, f64::NAN, f64::INFINITY, 1e-300, 2.0, -3.5].into(),
            arm_v: [1.0 / 3.0; 7].into(),
            base_velocity: [0.1 + 0.2, f64::NEG_INFINITY, 0.0],
            finger_q: 0.04,
            finger_force: 20.0,
            vacuum: 0.7,
        };
        let text = serde_json::to_vec(&CommandMessage::from(&command)).unwrap();
        let back = Command::try_from(&serde_json::from_slice::<CommandMessage>(&text).unwrap()).unwrap();
        let bits = |c: &Command| {
            let numbers = c.arm_q.iter().chain(&c.arm_v).chain(&c.base_velocity);
            numbers
                .chain([&c.finger_q, &c.finger_force, &c.vacuum])
                .map(|x| x.to_bits())
                .collect::<Vec<u64>>()
        };
        assert_eq!(bits(&back), bits(&command));
        let short = r#"{"arm_q":[0],"arm_v":[0],"base_velocity":[0],"finger_q":0,"finger_force":0}"#;
        assert!(serde_json::from_str::<CommandMessage>(short).is_err());
    }
}
