//! Figures of a robot's servos in SI units, read from its config and its description.

use super::{BaseServo, Drivetrain};
use crate::articulation::Limit;
use crate::base::BaseJoint;
use crate::finger::FoundFinger;
use crate::joint_values::MAX_ARM_DOF;
use crate::model::RobotModel;
use orchard_quantity::Quantity;

/// Figures of a robot's servos; the law is that of [`Servos`](super::Servos). Limits of the arm's joints are those of its kinematics.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoParameters {
    /// Drive of the base; `None` for a base that stands.
    pub base: Option<BaseServo>,
    /// Gains of the height joint.
    pub height: Option<Gains>,
    /// Gains of each arm joint.
    pub arm: Gains,
    /// Largest acceleration of the arm's set points [rad/s2].
    pub arm_acceleration: f64,
    /// Drivetrains of the arm's joints.
    pub drivetrains: [Drivetrain; MAX_ARM_DOF],
    /// Compensated gravity torque over the true one \[1\].
    pub gravity_share: f64,
    /// Gains of each finger at its pad.
    pub finger: Option<Gains>,
    /// Largest speed of a finger's set point [m/s].
    pub finger_speed: f64,
    /// Largest force of a finger at its pad \[N\].
    pub finger_force: f64,
    /// The fingers.
    pub fingers: Vec<FingerServo>,
    /// Mass that the height joint carries \[kg\].
    pub carried_mass: f64,
}

/// A finger's range of openings, and the inertia that its driving joint moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerServo {
    /// Least opening \[m\].
    pub lower: f64,
    /// Largest opening \[m\].
    pub upper: f64,
    /// Inertia [kg or kg m^2].
    pub inertia: f64,
}

/// Position gain and velocity gain: effort for each unit of position and of velocity that is missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// Position gain [N/m or N m/rad].
    pub stiffness: f64,
    /// Velocity gain [N s/m or N m s/rad].
    pub damping: f64,
}

impl ServoParameters {
    /// Figures of the servos of a robot.
    pub fn new(robot: &RobotModel) -> Self {
        let c = robot.config();
        let kinematics = robot.kinematics();
        let rail = match robot.roles.base_joint {
            BaseJoint::Rail { on, .. } => robot.articulation().links[on].limit,
            _ => None,
        };
        Self {
            base: c.drive.as_ref().map(|c| BaseServo::new(c, robot.mass(), robot.yaw_inertia(), rail)),
            height: c.height.as_ref().map(Gains::new),
            arm: Gains { stiffness: c.arm.stiffness.si(), damping: c.arm.damping.si() },
            arm_acceleration: c.arm.acceleration_max.si(),
            drivetrains: drivetrains(robot),
            gravity_share: 1.0 + c.arm.gravity_error.as_ref().map_or(0.0, |error| error.si()),
            finger: c.finger.as_ref().map(|c| Gains { stiffness: c.stiffness.si(), damping: c.damping.si() }),
            finger_speed: kinematics.finger_speed(),
            finger_force: kinematics.finger_force(),
            fingers: robot.roles.fingers.iter().map(FingerServo::new).collect(),
            carried_mass: robot.carried_mass(),
        }
    }
}

impl FingerServo {
    fn new(found: &FoundFinger) -> Self {
        let Limit { lower, upper, .. } = found.limit;
        Self { lower, upper, inertia: found.inertia }
    }
}

impl Gains {
    fn new(gains: &crate::config::Gains) -> Self {
        Self { stiffness: gains.stiffness.si(), damping: gains.damping.si() }
    }
}

/// Drivetrains of the arm's joints: the config's figures, else the description's.
fn drivetrains(robot: &RobotModel) -> [Drivetrain; MAX_ARM_DOF] {
    let arm = &robot.config().arm;
    std::array::from_fn(|i| {
        let Some(&link) = robot.roles.arm.get(i) else { return Drivetrain::default() };
        let friction = robot.articulation().links[link].friction;
        let given = |list: &[Quantity], other: f64| list.get(i).map_or(other, Quantity::si);
        Drivetrain {
            armature: given(&arm.armature, 0.0),
            coulomb: given(&arm.friction, friction.coulomb),
            viscous: given(&arm.viscous_friction, friction.viscous),
        }
    })
}
