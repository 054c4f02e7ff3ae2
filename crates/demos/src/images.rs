//! Images of observations as PNG files.

use orchard_exchange::{depth_png, image_png};
use orchard_geometry::{DepthImage, Image};
use orchard_policy::{Field, Values};

/// The form in which a field of an observation is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// A list of numbers in the table.
    Numbers,
    /// A 16-bit grey PNG of depths.
    Depth,
    /// A colour PNG.
    Colour,
    /// Not stored: it follows from another field (`depth_valid`: the depth is not 0).
    Derived,
}

impl Form {
    /// The form of a field, by its type and shape.
    pub fn of(field: &Field) -> Self {
        match (field.dtype, field.shape.len()) {
            ("float32", 1) => Self::Numbers,
            ("float32", 2) => Self::Depth,
            ("uint8", 3) => Self::Colour,
            _ => Self::Derived,
        }
    }
}

/// A field's image as PNG, with the number of pixels whose depth does not fit into it; `None` if the field is no image.
pub(crate) fn png(field: &Field, values: &Values, depth_unit: f64) -> Option<Result<(Vec<u8>, u64), String>> {
    let (height, width) = (*field.shape.first()?, *field.shape.get(1)?);
    let encoded = match (Form::of(field), values) {
        (Form::Depth, Values::F32(depths)) => {
            let image = DepthImage::from_pixels(width, height, depths.clone())?;
            depth_png::write(&image, depth_unit).map(|png| (png, depth_png::unfit(&image, depth_unit)))
        }
        (Form::Colour, Values::U8(bytes)) => {
            let image = Image::from_pixels(width, height, bytes.as_chunks::<3>().0.to_vec())?;
            image_png::write_rgb(&image).map(|png| (png, 0))
        }
        _ => return None,
    };
    Some(encoded.map_err(|e| e.to_string()))
}
