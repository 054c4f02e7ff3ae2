//! Images of a bag, raw or packed.

use orchard_exchange::{colour_image, depth_image};
use orchard_geometry::{DepthImage, Image};
use orchard_recording::bag::{ColourImage, ImageHeader, PackedImage, RosImage};

/// Depth image, as sent.
pub enum Depth {
    Raw(RosImage),
    Packed(PackedImage),
}

impl Depth {
    pub fn header(&self) -> &ImageHeader {
        match self {
            Depth::Raw(image) => image.header(),
            Depth::Packed(image) => &image.header,
        }
    }

    /// Bytes of its message.
    pub fn length(&self) -> usize {
        match self {
            Depth::Raw(image) => image.length(),
            Depth::Packed(image) => image.data.len(),
        }
    }

    /// Image in metres and depth of value 1 \[m\], by default the usual one.
    pub fn read(&self, unit: Option<f64>) -> Result<(DepthImage, f64), String> {
        match self {
            Depth::Raw(image) => {
                let unit = unit.unwrap_or(image.usual_unit());
                Ok((image.depth(unit), unit))
            }
            Depth::Packed(image) => {
                let told = |e: depth_image::DepthError| e.to_string();
                let raw = depth_image::read_transported(&image.format, &image.data).map_err(told)?;
                let unit = unit.unwrap_or(raw.usual_unit());
                Ok((raw.depth(unit).map_err(told)?, unit))
            }
        }
    }
}

/// Colour image, as sent.
pub enum Colour {
    Raw(ColourImage),
    Packed(PackedImage),
}

impl Colour {
    pub fn header(&self) -> &ImageHeader {
        match self {
            Colour::Raw(image) => image.header(),
            Colour::Packed(image) => &image.header,
        }
    }

    /// Bytes of its message.
    pub fn length(&self) -> usize {
        match self {
            Colour::Raw(image) => image.length(),
            Colour::Packed(image) => image.data.len(),
        }
    }

    pub fn read(&self) -> Result<Image<[u8; 3]>, String> {
        match self {
            Colour::Raw(image) => Ok(image.rgb()),
            Colour::Packed(image) => colour_image::read(&image.data)
                .map_err(|e| format!("a compressed image of format \"{}\" {e}", image.format.escape_debug())),
        }
    }
}
