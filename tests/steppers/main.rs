//! Suite over [`orchard_batch::Stepper`]: every batch against the f64 worlds that it was made of, under the same inputs.

mod backends;
mod detachment;
mod forces;
mod pull_and_release;
mod quarantine;
mod reset;
#[path = "../../crates/gpu/tests/device/mod.rs"]
pub(crate) mod testing;
#[path = "../../crates/batch/tests/trees/mod.rs"]
mod trees;
