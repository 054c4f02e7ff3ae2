//! Tests of `orchard-treephys` from outside, in one binary: a folder or file a subject.

mod beam;
#[path = "break.rs"]
mod breaking;
mod damping;
mod fixture;
mod timber;
mod unions;
mod wind;
