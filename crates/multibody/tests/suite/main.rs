//! Tests of `orchard-multibody` from outside, in one binary: a folder or file a subject.

mod aba;
mod builder;
#[path = "common/canopy.rs"]
mod canopy;
mod common;
mod contact;
mod contact_dense;
mod physics;
mod shapes;
#[cfg(feature = "cholesky")]
mod solvers;
mod spin;
