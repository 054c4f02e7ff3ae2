//! Finds fruit-sized spheres in depth images, simulated or real.
//!
//! [`detect`] is the paper's geometric detector (section "Geometric fruit perception"): back-projection, depth-continuous patches, linear
//! least-squares spheres, gates. [`mask`] masks the robot and the ground, [`Tracker`] merges detections of several images into tracks. The
//! crate needs no simulator: its input is a depth image with intrinsics. Equations: `docs/computation/perception.md`.

mod cloud;
pub mod config;
mod cylinder;
mod detect;
mod disc;
mod error;
mod evidence;
mod for_camera;
mod gates;
mod geometric;
mod image;
mod learned;
pub mod mask;
mod noise;
mod onnx;
mod outline;
mod posterior;
mod region;
mod score;
mod search;
mod segment;
mod sizes;
mod sphere;
mod track;
mod votes;

pub use config::DetectorConfig;
pub use detect::{candidates, detect};
pub use error::PerceptionError;
pub use evidence::Evidence;
pub use for_camera::{detector_for, detectors, geometric_detector_for};
pub use gates::Gate;
pub use geometric::{Candidate, Detection};
pub use image::RgbdImage;
pub use onnx::Onnx;
pub use region::{Region, box_overlap, fit_regions};
pub use sphere::Sphere;
pub use track::{Sighting, Track, Tracker};
