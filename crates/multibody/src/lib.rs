//! Articulated-body dynamics with implicit springs and compliant contact.
//!
//! [`Model`] is what never changes (topology, placement, inertia, shapes); [`Data`] is state, the inputs of
//! the next step and scratch. A step solves, for the velocity change dv over the substep h,
//!
//! `(M + h (D + C) + h^2 K) dv = h (tau - c(q, v) - K (q - q0 + h v) - (D + C) v)` plus contact impulses,
//!
//! exactly in O(n) by the articulated-body algorithm, with K and D as implicit armature.

pub mod data;
pub mod model;

pub use data::Data;
pub use model::{
    Body, BodyId, Collider, ColliderId, Coupling, Groups, JointKind, Model, ModelBuilder, Owner, PointBody,
    PointId, SpatialInertia, Tether,
};
