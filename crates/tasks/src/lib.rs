//! The tasks of the OrchardBench benchmark, and the protocol that they share.
//!
//! [`harvest`]: a controller picks fruit. [`detect`]: a detector sees single images. [`component`]: a controller reaches one target.
//! [`verify`]: a recorded trajectory is played back. Each turns a plan into records, and records into a summary, by means of
//! `orchard-bench`; [`protocol::Protocol`] holds their constants. `docs/benchmark-v1.md` states what each figure means.

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
mod stall;
pub mod vantage;
pub mod verify;
pub mod zones;
