//! Articulated-body dynamics with implicit springs and compliant contact.
//!
//! [`Model`] is what never changes (topology, placement, inertia, shapes); [`Data`] is state, the inputs of
//! the next step and scratch. A step solves, for the velocity change dv over the substep h,
//!
//! `(M + h (D + C) + h^2 K) dv = h (tau - c(q, v) - K (q - q0 + h v) - (D + C) v)` plus contact impulses,
//!
//! exactly in O(n) by the articulated-body algorithm, with K and D as implicit armature. Every equation is
//! derived, in the order in which a step solves them, in `docs/computation/dynamics.md`.
//!
//! ```
//! use nalgebra::Vector3;
//! use orchard_geometry::{Mat3, Pose};
//! use orchard_multibody::*;
//!
//! let mut builder = ModelBuilder::new();
//! let rod = SpatialInertia { mass: 1.0, p_com: Vector3::new(0.5, 0.0, 0.0), i_com: Mat3::identity() * 0.08 };
//! let pendulum = builder.add_body(Body {
//!     parent: None,
//!     joint: JointKind::Hinge(Vector3::y_axis()),
//!     x_parent_joint: Pose::identity(),
//!     inertia: rod,
//! });
//! let model = builder.build()?;
//! let mut data = Data::new(&model);
//! let mut report = StepReport::default();
//! let settings = StepSettings {
//!     h: 1.0 / 180.0,
//!     gravity: Vector3::new(0.0, 0.0, -9.81),
//!     contact_dissipation_time: 0.01,
//!     contact_margin: 0.01,
//!     integrator: Integrator::default(),
//!     solver: Solver::default(),
//!     contact_path: ContactPath::default(),
//! };
//! step(&model, &mut data, &settings, &mut report);
//! assert!(data.velocity(pendulum).angular.y > 0.0);
//! # Ok::<(), ModelError>(())
//! ```

pub mod aba;
pub mod builder;
pub mod contact;
pub mod data;
pub mod energy;
mod impulse;
mod integrate;
pub mod jacobian;
mod kinematics;
mod lanes;
mod midpoint;
pub mod model;
mod parts;
pub mod rnea;
mod rod;
mod rotation;
mod schedule;
mod settings;
pub mod solver;
pub mod spatial;
mod state;
pub mod statics;
pub mod step;
mod substep;
mod symmetric;
mod vectors;
mod velocity_products;

pub use builder::{ModelBuilder, ModelError};
pub use contact::{ContactPath, ContactReport, Gap, GapFinder, accept_overlaps};
pub use data::{Data, Motion, forward_kinematics, forward_kinematics_of};
pub use energy::{Energy, energy};
pub use jacobian::geometric_jacobian;
pub use model::{
    Body, BodyId, Collider, ColliderId, Coupling, Groups, JointKind, Model, Owner, PointBody, PointId,
    SpatialInertia, Tether,
};
pub use rnea::{gravity_torque, inertia_product, inverse_dynamics};
pub use rod::Deflection;
pub use solver::{LinearSolve, Preconditioner, Solver};
pub use spatial::{Twist, Wrench};
pub use state::{State, StateError};
pub use statics::{StaticsError, equilibrium};
pub use step::{Integrator, StepReport, StepSettings, step};
pub use velocity_products::SLOW_TURN;

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
