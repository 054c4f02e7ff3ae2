//! Renders depth, label and instance images of a scene on the CPU, and colour pictures of it.
//!
//! [`render`] is the exact depth camera: ray-primitive intersections with a z-buffer. [`Sensor`] adds the errors of a depth
//! camera. [`mod@picture`] draws the same [`Scene`] in colour. Detector and picker do not depend on this crate: they receive
//! [`orchard_geometry::DepthImage`] only.

pub mod blade;
pub mod picture;

mod bounds;
mod depth;
mod moving;
mod primitive;
mod raster;
mod scene;
mod sensor;
mod solid;
mod visibility;

pub use depth::{Frame, render};
pub use moving::MovingScene;
pub use scene::{Geometry, Item, Label, NO_INSTANCE, Rgb, Scene, Tint};
pub use sensor::{
    Capture, CoveredPixels, Exposure, FieldScale, ImageKey, Sensor, StereoErrors, TimeOfFlightErrors,
};
pub use solid::Solid;
pub use visibility::{FruitView, PixelBox, fruit_views};
