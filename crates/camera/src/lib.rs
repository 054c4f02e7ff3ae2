//! Depth, label and instance images of a scene, rendered on the CPU, and pictures of it for people.
//!
//! [`render`] is the measuring camera: exact ray-primitive intersections behind a z-buffer. [`picture`] draws
//! the same [`Scene`] in colour. Nothing here is visible to the detector or to the picker; they see
//! [`orchard_geometry::DepthImage`] only.

pub mod blade;
pub mod picture;

mod bounds;
mod depth;
mod primitive;
mod scene;
mod sensor;
mod visibility;

pub use depth::{Frame, render};
pub use scene::{Geometry, Item, Label, NO_INSTANCE, Rgb, Scene, Tint};
pub use sensor::{Capture, ImageKey, Sensor};
pub use visibility::{FruitView, PixelBox, fruit_views};
