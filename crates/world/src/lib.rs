//! One simulated orchard world: tree, fruit, leaves, ground, robot and camera.
//!
//! [`World::new`] is a function of (spec, robot, seed, world index) alone. A frame is
//! observation -> command -> [`World::step`] -> [`WorldEvent`]s; nothing that a controller receives holds a
//! pose or a label of the world. [`truth`] is what a benchmark may ask.

mod build;
mod camera;
mod event;
pub mod groups;
mod reach;
mod scene;
mod touch;
pub mod truth;
mod world;

pub use build::WorldError;
pub use camera::CameraTruth;
pub use event::{Status, WorldEvent};
pub use world::World;
