//! Measurements on trees in the form of orchard surveys: pure functions of a skeleton and its growth units.
//!
//! [`branches`] cuts a tree into the pieces of wood between forks that orchard surveys measure (Brym and
//! Ernest 2018); [`allometry`] fits and compares; [`shoots`] counts growth units and reads their angles.

pub mod allometry;
pub mod branches;
pub mod distribution;
pub mod shoots;
