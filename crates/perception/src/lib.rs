//! Finds fruit-sized spheres in depth images, simulated or real.
//!
//! [`detect`] is the paper's geometric detector (section "Geometric fruit perception"): back-projection,
//! depth-continuous patches, linear least-squares spheres, gates. [`mask`] removes the robot and the ground,
//! [`Tracker`] asks for persistence over images. Nothing here knows a simulator: input is a depth image with
//! intrinsics, see `docs/computation/perception.md`.

mod config;
mod detect;
mod error;
pub mod mask;
mod track;

pub use config::DetectorConfig;
pub use detect::{Detection, detect};
pub use error::PerceptionError;
pub use track::{Sighting, Track, Tracker};
