//! The image that a detector searches: depth, and colour if there is some.

use orchard_geometry::{DepthImage, Image};

/// An image that a detector looks at. Depth alone is one, too.
#[derive(Debug, Clone, Copy)]
pub struct RgbdImage<'a> {
    /// Depth \[m\].
    pub depth: &'a DepthImage,
    /// Colour (sRGB), registered to depth and of its size. Only a network that sees colour looks at it.
    pub colour: Option<&'a Image<[u8; 3]>>,
}

impl<'a> From<&'a DepthImage> for RgbdImage<'a> {
    fn from(depth: &'a DepthImage) -> Self {
        Self { depth, colour: None }
    }
}
