//! Mobile manipulators read from URDF: kinematics, servos, observations and commands.
//!
//! [`Articulation`] reads any URDF tree; [`RobotModel`] adds the parts that a harvester needs (base, height,
//! arm, fingers or suction cup, bucket, wrist camera) and puts them into a world's model. [`Servos`] turns a [`Command`] into
//! implicit springs, dampers and torques each substep; [`observe`] reads the sensors. [`ArmKinematics`] is the arm alone, for controllers; it
//! needs no world. Equations: `docs/computation/robot.md`.

mod arm;
mod articulation;
mod assembly;
mod assets;
mod base;
mod braking;
mod built_in;
mod chain;
mod clearance;
mod config;
mod cup;
mod error;
mod finger;
mod handle;
mod harvester;
mod ik;
mod ik_trial;
pub mod io;
mod joint_values;
mod mesh;
mod model;
mod observe;
mod outline;
mod parameters;
mod pictures;
mod plausible;
mod qp;
mod resources;
mod roles;
mod servo;
mod size;
mod survey;
mod warning;

pub use arm::{ArmKinematics, BaseMotion, Jacobian, JointVector};
pub use articulation::{
    Articulation, Frame, Friction, Limit, Limits, Link, LinkShape, Loaded, MeshUse, Mimic,
};
pub use base::BaseJoint;
pub use built_in::{PAPER_TOML, PAPER_URDF};
pub use clearance::SelfDistance;
pub use config::{
    BaseDrive, BucketConfig, CupConfig, MountConfig, MountKind, Placement, ReachConfig, RobotConfig, Steering,
};
pub use cup::{Cup, Seal, Suction, UnderLip};
pub use error::RobotError;
pub use finger::{Curve, Finger, FingerLink, Opening, Turn};
pub use handle::{Bucket, PartGroups, RobotColliders, RobotHandle};
pub use ik::{IkFailure, IkTarget};
pub use ik_trial::IkTrial;
pub use io::{Climb, Command, Observation};
pub use joint_values::{JointValues, MAX_ARM_DOF, TooManyJoints};
pub use mesh::MeshFacts;
pub use model::RobotModel;
pub use observe::observe;
pub use orchard_multibody::Wrench;
pub use outline::outline;
pub use pictures::{PictureRequest, Pictures};
pub use qp::{Obstacle, QpGoal, QpState, QpStatus, QpStep, QpTask};
pub use resources::{NoMeshes, Resources};
pub use servo::{
    BaseServo, Drivetrain, FingerServo, Gains, ServoParameters, Servos, SetPoints, VelocityDrive,
};
pub use survey::{Draft, Guess, InertiaFacts, JointFacts, LinkFacts, RoleFacts, Survey};
pub use warning::Warning;
