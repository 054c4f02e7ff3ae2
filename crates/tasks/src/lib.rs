//! The tasks of the OrchardBench benchmark, and the protocol that they share.
//!
//! [`harvest`]: a controller picks fruit. [`detect`]: a detector finds fruit in single images. [`component`]: a controller reaches one
//! target. [`verify`]: a recorded trajectory is played back. `orchard-bench` computes the records of a plan and a summary of them;
//! [`protocol::Protocol`] holds the constants. `docs/benchmark-v1.md` defines the figures.

mod backend;
pub mod component;
pub mod detect;
#[cfg(any(test, feature = "fake"))]
pub mod fake;
pub mod harvest;
mod json;
mod matching;
pub mod plan_file;
pub mod protocol;
pub mod seeds;
pub mod stage;
pub mod stall;
pub mod vantage;
pub mod verify;
pub mod zones;
