//! Mobile manipulators read from URDF: kinematics, servos, observations and commands.
//!
//! [`Articulation`] reads any URDF tree; [`RobotModel`] adds the parts that a harvester needs (base, height,
//! arm, fingers, bucket, wrist camera) and puts them into a world's model. [`Servos`] turns a [`Command`] into
//! implicit springs, dampers and torques each substep; [`observe`] reads the sensors. [`ArmKinematics`] is the arm alone, for controllers; it
//! needs no world. Equations: `docs/computation/robot.md`.

mod arm;
mod articulation;
mod assembly;
mod braking;
mod chain;
mod clearance;
mod config;
mod error;
mod handle;
mod ik;
pub mod io;
mod model;
mod observe;
mod outline;
mod parameters;
mod plausible;
mod qp;
mod roles;
mod servo;
mod size;
mod survey;

pub use arm::{ArmKinematics, Jacobian, JointVector};
pub use articulation::{Articulation, Frame, Limit, Link, LinkShape, Mimic};
pub use clearance::SelfDistance;
pub use config::{PAPER_TOML, PAPER_URDF, RobotConfig};
pub use error::RobotError;
pub use handle::{Bucket, PartGroups, RobotColliders, RobotHandle};
pub use ik::{IkFailure, IkTarget};
pub use io::{ARM_DOF, Command, Observation};
pub use model::RobotModel;
pub use observe::observe;
pub use qp::{Obstacle, QpGoal, QpState, QpStatus, QpStep, QpTask};
pub use servo::{Servos, SetPoints};
pub use survey::{InertiaFacts, JointFacts, LinkFacts, MeshUse, RoleFacts, Survey};
