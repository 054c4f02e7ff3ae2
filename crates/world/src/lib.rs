//! One simulated orchard world: tree, fruit, leaves, posts and wires, ground, robot and camera.
//!
//! [`World::new`] is a function of (spec, robot, seed, world index) alone. A frame is
//! observation -> command -> [`World::step`] -> [`WorldEvent`]s; a controller receives no
//! pose and no label of the world. [`truth`] is the ground truth for benchmarks. A [`Snapshot`] keeps a world at one moment,
//! in memory or as bytes, to continue from there with the same bits.

mod build;
mod camera;
mod digest;
mod envelope;
mod event;
mod ground;
pub mod groups;
mod identity;
mod lent;
mod limb;
mod load;
mod pictures;
mod planting;
mod reach;
mod scene;
mod scenery;
mod sensing;
mod snapshot;
mod snapshot_error;
mod span;
mod state;
mod suction;
pub mod terrain;
mod touch;
pub mod truth;
#[cfg(test)]
mod weather_tests;
mod world;

pub use build::WorldError;
pub use camera::{CameraTruth, Sight};
pub use envelope::FORMAT_VERSION;
pub use event::{Status, WorldEvent};
pub use identity::Difference;
pub use lent::{Calm, Moved, Outlook, Stay};
pub use load::WoodLoad;
pub use orchard_fruit::Release;
pub use pictures::PictureSight;
pub use planting::{Appearance, Planting, tree_scene};
pub use snapshot::Snapshot;
pub use snapshot_error::SnapshotError;
pub use span::{Span, Turn};
pub use world::World;

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
