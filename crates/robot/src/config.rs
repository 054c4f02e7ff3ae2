//! Config of a robot: roles of the URDF's joints and links, servo gains, camera mount.

use crate::io::ARM_DOF;
use orchard_quantity::{ConfigError, Count, Quantity, from_toml};
use serde::{Deserialize, Serialize};

/// The preset `paper` as TOML text.
pub const PAPER_TOML: &str = include_str!("../configs/paper/robot.toml");

/// URDF text of the robot of preset `paper`: a Ridgeback with FR3 arm, hand and bucket.
pub const PAPER_URDF: &str = include_str!("../assets/robots/ridgeback_fr3.urdf");

/// Properties of a robot that its URDF does not hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotConfig {
    /// Names in the URDF.
    pub parts: Parts,
    /// Posture at the start of an episode.
    pub start: Start,
    /// Velocity actuators of the base.
    pub base: BaseDrive,
    /// Servo of the chassis height.
    pub height: Gains,
    /// Servos of the arm joints.
    pub arm: ArmDrive,
    /// Servos of the fingers.
    pub finger: FingerDrive,
    /// Contact properties of the surfaces.
    pub surface: Surface,
    /// Wrist camera mount.
    pub camera: CameraMount,
    /// Inverse kinematics.
    pub ik: IkConfig,
    /// Inverse kinematics by quadratic programs.
    pub qp: QpConfig,
}

/// Names of links and joints in the URDF.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parts {
    /// Link whose frame is `base`.
    pub base_link: String,
    /// Planar joint of the base.
    pub base_joint: String,
    /// Prismatic joint of the chassis height.
    pub height_joint: String,
    /// Revolute joints of the arm, from the shoulder out.
    pub arm_joints: [String; ARM_DOF],
    /// Prismatic joints of the two fingers.
    pub finger_joints: [String; 2],
    /// Link of the hand: z is the approach axis, the fingers move along y.
    pub hand_link: String,
    /// Link at the point between the finger pads.
    pub tcp_link: String,
    /// Link of the bucket; the walls and the floor are boxes.
    pub bucket_link: String,
}

/// The robot at the start of an episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// Opening of each finger.
    pub finger_opening: Quantity,
    /// Arm joint positions.
    pub arm_home: [Quantity; ARM_DOF],
}

/// Velocity actuators of a holonomic base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaseDrive {
    /// Force per velocity error.
    pub damping: Quantity,
    /// Largest force (traction).
    pub force_max: Quantity,
    /// Torque per turn-rate error.
    pub turn_damping: Quantity,
    /// Largest torque.
    pub torque_max: Quantity,
    /// Largest speed along each base axis.
    pub speed_max: Quantity,
    /// Largest turn rate.
    pub turn_speed_max: Quantity,
    /// Largest change of the commanded velocity per second.
    pub acceleration_max: Quantity,
    /// Largest change of the commanded turn rate per second.
    pub turn_acceleration_max: Quantity,
}

/// Gains of a position servo.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// Force or torque per position error.
    pub stiffness: Quantity,
    /// Force or torque per velocity.
    pub damping: Quantity,
}

/// Position servos of the arm. The URDF holds speed and effort limits; it has no field for acceleration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmDrive {
    /// Torque per position error.
    pub stiffness: Quantity,
    /// Torque per velocity.
    pub damping: Quantity,
    /// Largest acceleration of each joint's set point.
    pub acceleration_max: Quantity,
}

/// Position servos of the fingers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FingerDrive {
    /// Force per position error.
    pub stiffness: Quantity,
    /// Force per velocity.
    pub damping: Quantity,
    /// Largest force of each drive.
    pub force_max: Quantity,
    /// Largest speed of the commanded opening.
    pub speed_max: Quantity,
    /// Stiffness of the mechanism that keeps the fingers symmetric.
    pub coupling_stiffness: Quantity,
    /// Damping of the mechanism that keeps the fingers symmetric.
    pub coupling_damping: Quantity,
}

/// Coulomb coefficients and stiffness of the robot's surfaces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// Coulomb coefficient of arm, chassis and bucket.
    pub body_friction: Quantity,
    /// Coulomb coefficient of the fingers.
    pub finger_friction: Quantity,
    /// Contact stiffness.
    pub stiffness: Quantity,
}

/// Pose of the wrist camera: position in the hand frame; the optical axis is the hand's z turned by `toe_in`
/// towards the approach axis; the image's upper side points away from it (along the offset).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraMount {
    /// Position along the hand's x.
    pub x: Quantity,
    /// Position along the hand's y.
    pub y: Quantity,
    /// Position along the hand's z.
    pub z: Quantity,
    /// Turn of the optical axis towards the approach axis.
    pub toe_in: Quantity,
}

/// Damped least squares with restarts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IkConfig {
    /// Largest number of iterations of one attempt.
    pub iterations: Count,
    /// Number of attempts from further start postures.
    pub restarts: Count,
    /// Largest damping factor, in units of the Jacobian (metres and radians weighed alike).
    pub damping: Quantity,
    /// Largest joint step of one iteration.
    pub step_max: Quantity,
    /// Accepted position error.
    pub position_tolerance: Quantity,
    /// Accepted orientation error.
    pub angle_tolerance: Quantity,
    /// Step towards the home posture in the null space, per iteration and per unit of error.
    pub home_gain: Quantity,
}

/// Quadratic programs at control rate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QpConfig {
    /// Weight of a rotation error against a position error: the square of a lever [m^2].
    pub angle_weight: Quantity,
    /// Weight of the joint velocities against the tracking error.
    pub damping: Quantity,
    /// Rate at which the null-space motion goes to the preferred posture.
    pub posture_gain: Quantity,
    /// Distance below which a constraint is added.
    pub influence: Quantity,
    /// Largest closing speed of two links, per distance above the least one.
    pub approach_rate: Quantity,
    /// Least distance between links.
    pub self_clearance: Quantity,
    /// Cost of closing in on another link faster than allowed, where the limits leave no choice.
    pub self_penalty: Quantity,
    /// Largest number of constraints of links against obstacles; the nearest are taken.
    pub canopy_rows: Count,
    /// Largest number of iterations of the interior-point method.
    pub iterations: Count,
}

impl RobotConfig {
    /// Reads a config from TOML text; `file` names the config in errors.
    ///
    /// # Errors
    /// The text is not TOML, a field is missing or unknown, or a value lies outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        from_toml(file, text)
    }

    /// The preset `paper`.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn paper() -> Self {
        match Self::from_toml("paper/robot.toml", PAPER_TOML) {
            Ok(config) => config,
            Err(e) => unreachable!("embedded preset: {e}"),
        }
    }
}
