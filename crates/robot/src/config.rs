//! Config of a robot: roles of the URDF's joints and links, servo gains, camera mount.

use crate::articulation::{Limit, Limits};
use crate::assets::base_text;
use crate::joint_values::{JointValues, MAX_ARM_DOF};
use crate::plausible::{EFFORT_MAX, MASS_MAX};
use orchard_quantity::{ConfigError, Count, Quantity, Span, from_table, parse, with_base};
use serde::{Deserialize, Serialize};

/// Properties of a robot that its URDF does not hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotConfig {
    /// Names in the URDF. Joints that are not named are locked at 0, and their links become parts of those that carry them.
    pub parts: Parts,
    /// Posture at the start of an episode.
    pub start: Start,
    /// Velocity actuators of the base; none for a base that stands.
    #[serde(default)]
    pub drive: Option<BaseDrive>,
    /// Servo of the chassis height; none for a chassis without that joint.
    #[serde(default)]
    pub height: Option<Gains>,
    /// Servos of the arm joints.
    pub arm: ArmDrive,
    /// Servos of the fingers; none for a hand with a suction cup.
    #[serde(default)]
    pub finger: Option<FingerDrive>,
    /// Suction cup; none for a hand with fingers.
    #[serde(default)]
    pub cup: Option<CupConfig>,
    /// Contact properties of the surfaces.
    pub surface: Surface,
    /// Wrist camera mount.
    pub camera: CameraMount,
    /// Inverse kinematics.
    pub ik: IkConfig,
    /// Inverse kinematics by quadratic programs.
    pub qp: QpConfig,
    /// Limits that complete or replace those of the URDF, by joint: as in the limits file.
    #[serde(default)]
    pub limits: Limits,
    /// Folders with the packages that mesh files are in, relative to the config's folder.
    #[serde(default, skip_serializing)]
    pub package_path: Vec<String>,
    /// Joint between the ground and the root of a URDF that has none. A frame `mount` on the ground under the root serves as `parts.base_link`.
    #[serde(default)]
    pub mount: Option<MountConfig>,
    /// Bucket of a robot whose URDF has none: a square box on the base, open at the top.
    #[serde(default)]
    pub bucket: Option<BucketConfig>,
    /// Reach of the arm; none for the figures of the world's config, which are the paper's robot's.
    #[serde(default)]
    pub reach: Option<ReachConfig>,
    /// Place beside the tree; none for a base that drives there.
    #[serde(default)]
    pub placement: Option<Placement>,
    /// Figures of the built-in controllers that differ for this robot: table `picker` is laid over `configs/baseline/picker.toml`, which they
    /// share, table `expert` over `configs/expert/picker.toml`.
    #[serde(default)]
    pub tuning: toml::Table,
}

/// Joint between the ground and the root of a URDF.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MountConfig {
    /// Way in which the root can move; its joint is named `parts.base_joint`.
    pub joint: MountKind,
    /// Height of the root's frame above the ground.
    pub height: Quantity,
}

/// Ways in which the root of a URDF can move on the ground.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum MountKind {
    /// It stands.
    Stands,
    /// It drives in the plane.
    Drives,
    /// It slides along its y axis.
    Slides {
        /// Ends of the rail.
        range: Span,
        /// Largest speed.
        speed_max: Quantity,
        /// Largest force.
        force_max: Quantity,
    },
}

impl MountKind {
    /// Limits of the joint; none unless it slides.
    pub(crate) fn limit(&self) -> Option<Limit> {
        let Self::Slides { range, speed_max, force_max } = self else { return None };
        let (lower, upper) = range.si();
        Some(Limit { lower, upper, velocity: speed_max.si(), effort: force_max.si() })
    }
}

/// A bucket of boxes, fixed to the base: square, open at the top.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BucketConfig {
    /// Position of its axis in the base frame, forward.
    pub x: Quantity,
    /// Position of its axis in the base frame, to the left.
    pub y: Quantity,
    /// Height of the floor above the base's origin.
    pub floor: Quantity,
    /// Inner width.
    pub width: Quantity,
    /// Inner depth.
    pub depth: Quantity,
    /// Thickness of walls and floor.
    pub wall: Quantity,
}

/// Reach of an arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReachConfig {
    /// Radius of the reach sphere about the origin of the arm's second joint, to the point between the finger pads.
    pub radius: Quantity,
    /// Admissible horizontal distance from that joint to the fruit.
    pub stand_off: Span,
}

/// Place of a base that does not drive to the tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Placement {
    /// Horizontal distance from the trunk to the base.
    pub distance: Span,
    /// Turn from facing the trunk, positive to the left.
    pub heading: Span,
}

/// Numbers of arm joints that are supported.
const ARM_DOF: std::ops::RangeInclusive<usize> = 4..=MAX_ARM_DOF;

/// Names of links and joints in the URDF.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parts {
    /// Link whose frame is `base`: on the ground, x forward, y left.
    pub base_link: String,
    /// Joint of the base at the root of the URDF: planar on the ground, prismatic on a rail; none for a base that stands.
    #[serde(default)]
    pub base_joint: Option<String>,
    /// Prismatic joint of the chassis height, which follows the ground.
    #[serde(default)]
    pub height_joint: Option<String>,
    /// Four to eight revolute joints of the arm, from the shoulder out.
    pub arm_joints: Vec<String>,
    /// Joints of the two fingers on the last arm link, prismatic or revolute, which joints that mimic them follow; none for a hand with a suction cup.
    #[serde(default)]
    pub finger_joints: Option<[String; 2]>,
    /// Link of the hand: z is the approach axis, the fingers open along y.
    pub hand_link: String,
    /// Link at the point between the finger pads, or at the centre of the cup's lip with z along the cup's axis.
    pub tcp_link: String,
    /// Link of the bucket; the walls and the floor are boxes.
    pub bucket_link: String,
}

/// The robot at the start of an episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// Opening of each finger; none for a hand with a suction cup.
    #[serde(default)]
    pub finger_opening: Option<Quantity>,
    /// Positions of the arm joints.
    pub arm_home: Vec<Quantity>,
}

impl Start {
    /// Opening of each finger \[m\]; 0 without fingers.
    pub fn finger_opening(&self) -> f64 {
        self.finger_opening.as_ref().map_or(0.0, Quantity::si)
    }

    /// Positions of the arm joints \[rad\].
    pub fn arm_home(&self) -> JointValues {
        JointValues::from_fn(self.arm_home.len(), |i| self.arm_home[i].si())
    }
}

/// Ways in which a base on the ground can move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Steering {
    /// In any direction, turning at will.
    Holonomic,
    /// Forwards and backwards, turning at will.
    Differential,
    /// Forwards and backwards, turning only while it moves.
    Ackermann {
        /// Radius of the tightest turn of the base's origin.
        turning_radius: Quantity,
    },
}

/// Velocity actuators of a base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaseDrive {
    /// Ways in which the base can move; a rail needs no steering.
    pub steering: Steering,
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
    /// Inertia of each joint's rotor and gears as the joint feels it (that of the rotor times the square of the gear ratio); without the entry 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub armature: Vec<Quantity>,
    /// Coulomb friction of each joint; without the entry that of the URDF (`<dynamics friction>`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub friction: Vec<Quantity>,
    /// Viscous friction of each joint; without the entry that of the URDF (`<dynamics damping>`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub viscous_friction: Vec<Quantity>,
    /// Relative error of the gravity torques that the servos compensate: at 0.05 they lift 5 % too much. From -1 to 1; without the entry 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity_error: Option<Quantity>,
    /// Mass fixed to the tool point in addition to the URDF's, which the servos' gravity compensation knows; without the entry 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub payload: Option<Quantity>,
}

/// Position servos of the fingers. Figures of hinged fingers are those at the pads, too.
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

/// Suction cup with the pump behind it; `docs/computation/suction.md` has the equations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CupConfig {
    /// Radius of the circle on which the lip seals.
    pub lip_radius: Quantity,
    /// Half the thickness of the lip.
    pub lip_half_thickness: Quantity,
    /// Number of points of the lip, equally spaced, at which it is tested and touches.
    pub lip_points: Count,
    /// Stiffness of the whole lip along the cup's axis.
    pub stiffness: Quantity,
    /// Coulomb coefficient of the lip.
    pub friction: Quantity,
    /// Gap over which the lip still bends to the surface while it touches elsewhere.
    pub follow: Quantity,
    /// Smallest radius of a ball on which the lip lies without folds.
    pub curve_radius_min: Quantity,
    /// Gap that a leaf under the lip leaves.
    pub leaf_gap: Quantity,
    /// Vacuum of the pump with the cup closed, below the pressure of the air.
    pub vacuum_max: Quantity,
    /// Open area of the lip at which the pump keeps half of that vacuum.
    pub leak_half: Quantity,
    /// Time constant of the vacuum in a closed cup.
    pub rise_time: Quantity,
    /// Vacuum from which the cup counts as sealed.
    pub grip_vacuum: Quantity,
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

impl ArmDrive {
    /// Field and problem of an entry that no arm of this many joints can have.
    fn problem(&self, joints: usize) -> Option<(String, String)> {
        let lists = [
            ("arm.armature", &self.armature),
            ("arm.friction", &self.friction),
            ("arm.viscous_friction", &self.viscous_friction),
        ];
        for (field, list) in lists {
            if !list.is_empty() && list.len() != joints {
                return Some((field.to_owned(), format!("{} values for {joints} arm joints", list.len())));
            }
            if let Some(i) = list.iter().position(|x| !(0.0..=EFFORT_MAX).contains(&x.si())) {
                let problem = format!("{} must be within 0 and {EFFORT_MAX:e}", list[i].value());
                return Some((format!("{field}[{i}]"), problem));
            }
        }
        let of_one = [
            ("arm.gravity_error", &self.gravity_error, -1.0, 1.0),
            ("arm.payload", &self.payload, 0.0, MASS_MAX),
        ];
        of_one.into_iter().find_map(|(field, given, low, high)| {
            let value = given.as_ref()?.si();
            let problem = format!("{value} must be within {low} and {high}");
            (!(low..=high).contains(&value)).then(|| (field.to_owned(), problem))
        })
    }
}

impl RobotConfig {
    /// Reads a config from TOML text; `file` names the config in errors. With `base = "common"` the text leaves out
    /// what all robots share; with the name of a built-in robot it holds only what differs from that robot.
    ///
    /// # Errors
    /// The text is not TOML, a field is missing or unknown, or a value lies outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        let mut config: Self = from_table(file, with_base(file, parse(file, text)?, &base_text, &[])?)?;
        config.limits = config.limits.checked(file)?;
        let error = |field: &str, problem| {
            Err(ConfigError { file: file.to_owned(), field: field.to_owned(), problem })
        };
        let (joints, home) = (config.parts.arm_joints.len(), config.start.arm_home.len());
        if !ARM_DOF.contains(&joints) {
            let (least, most) = (ARM_DOF.start(), ARM_DOF.end());
            return error("parts.arm_joints", format!("{joints} joints, must be {least} to {most}"));
        }
        if home != joints {
            return error("start.arm_home", format!("{home} positions for {joints} arm joints"));
        }
        if let Some((field, problem)) = config.arm.problem(joints) {
            return error(&field, problem);
        }
        let hand = [
            config.parts.finger_joints.is_some(),
            config.finger.is_some(),
            config.start.finger_opening.is_some(),
        ];
        if hand.iter().any(|&given| given == config.cup.is_some()) {
            let problem = "must be given without parts.finger_joints, finger and start.finger_opening, or left out with all three";
            return error("cup", problem.to_owned());
        }
        for (joint, drive, names) in [
            (&config.parts.base_joint, config.drive.is_some(), ["parts.base_joint", "drive"]),
            (&config.parts.height_joint, config.height.is_some(), ["parts.height_joint", "height"]),
        ] {
            if joint.is_some() != drive {
                return error(names[1], format!("must be given with {} and only with it", names[0]));
            }
        }
        Ok(config)
    }
}
