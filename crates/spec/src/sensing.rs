//! Errors and delays of the robot's own sensors and of its commands.

use orchard_quantity::Quantity;
use serde::{Deserialize, Deserializer, Serialize};

/// Errors of odometry and joint sensors, and delays of images and commands. With all figures 0 the robot senses exactly and at once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensingSpec {
    /// Time from an image's delivery by the camera to the controller, in addition to the camera's own latency.
    #[serde(deserialize_with = "delay")]
    pub camera_delay: Quantity,
    /// Time from a command to the robot that obeys it.
    #[serde(deserialize_with = "delay")]
    pub command_delay: Quantity,
    /// Wheel odometry.
    pub odometry: OdometrySpec,
    /// Joint sensors of the arm.
    pub joints: JointSensorSpec,
}

/// Errors of wheel odometry, as standard deviations of normal errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OdometrySpec {
    /// Relative error of distances, constant for a world: slip of the wheels and error of their radius.
    pub distance_slip: Quantity,
    /// Relative error of turns, constant for a world.
    pub turn_slip: Quantity,
    /// Random error of the distance after 1 m of travel; it grows with the root of the way.
    pub distance_noise: Quantity,
    /// Random error of the heading after 1 m of travel; it grows with the root of the way.
    pub heading_noise: Quantity,
}

/// Errors of joint sensors, as standard deviations of normal errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointSensorSpec {
    /// Error of a joint's position that is constant for a world: calibration.
    pub offset: Quantity,
    /// Error of a position that is independent from frame to frame.
    pub noise: Quantity,
    /// Error of a velocity that is independent from frame to frame.
    pub rate_noise: Quantity,
    /// Error of a torque that is independent from frame to frame.
    pub torque_noise: Quantity,
}

/// Longest delay \[s\], whatever range a file states: what is on its way is kept in memory.
const LONGEST_DELAY: f64 = 10.0;

pub(crate) fn delay<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Quantity, D::Error> {
    let quantity = Quantity::deserialize(deserializer)?;
    if (0.0..=LONGEST_DELAY).contains(&quantity.si()) {
        return Ok(quantity);
    }
    let problem = format!("{} is outside the range [0, {LONGEST_DELAY}] s of a delay", quantity.si());
    Err(serde::de::Error::custom(problem))
}
