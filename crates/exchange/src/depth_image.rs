//! Depth images of any usual form: PNG and TIFF, NumPy arrays (`.npy`) and archives of them (`.npz`), told apart by their first bytes.
//!
//! A value times a unit is the depth along the optical axis \[m\]. A value that is not a positive, finite number is no measurement.

mod numpy;
mod tiff;
mod transported;

use orchard_geometry::{DepthImage, Image};

use crate::depth_png::{self, MILLIMETRE, PngError};
use crate::intrinsics::{MOST_PIXELS, MOST_SIDE};

pub use transported::read_transported;

/// Error of reading a depth image.
#[derive(Debug, thiserror::Error)]
pub enum DepthError {
    /// The file is a PNG that cannot be read.
    #[error(transparent)]
    Png(#[from] PngError),
    /// The file is damaged or truncated.
    #[error("cannot be read as {format}: {problem}")]
    Damaged {
        /// Format by the first bytes.
        format: &'static str,
        /// Problem.
        problem: String,
    },
    /// The file holds something else than a depth image.
    #[error("is a {format} of {found}; {wanted} is needed")]
    Kind {
        /// Format by the first bytes.
        format: &'static str,
        /// Content.
        found: String,
        /// Content that is required.
        wanted: &'static str,
    },
    /// The image is larger than any depth camera's.
    #[error("is {width} x {height}; at most {MOST_SIDE} px a side and {MOST_PIXELS} px in all are read")]
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The first bytes are of no format that is read.
    #[error("is no PNG, TIFF, .npy or .npz file by its first bytes")]
    Unknown,
}

/// Values of a depth image as stored.
#[derive(Debug, Clone, PartialEq)]
pub struct RawDepth {
    width: usize,
    height: usize,
    values: Values,
}

/// Values, row by row.
#[derive(Debug, Clone, PartialEq)]
enum Values {
    Short(Vec<u16>),
    /// Whole numbers of more bits.
    Whole(Vec<f64>),
    Single(Vec<f32>),
    Double(Vec<f64>),
}

impl RawDepth {
    fn new(width: usize, height: usize, values: Values) -> Result<Self, DepthError> {
        check_size(width, height)?;
        Ok(Self { width, height, values })
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The usual unit \[m\]: a millimetre for whole numbers, a metre for floating-point numbers.
    pub fn usual_unit(&self) -> f64 {
        match self.values {
            Values::Short(_) | Values::Whole(_) => MILLIMETRE,
            Values::Single(_) | Values::Double(_) => 1.0,
        }
    }

    /// Image in metres; `unit` \[m\] is the depth of value 1.
    ///
    /// # Errors
    /// There are fewer values than pixels.
    pub fn depth(self, unit: f64) -> Result<DepthImage, DepthError> {
        let metres = |value: f64| {
            let z = (value * unit) as f32;
            if z.is_finite() && z > 0.0 { z } else { 0.0 }
        };
        let pixels = match self.values {
            Values::Short(values) => values.into_iter().map(|v| metres(f64::from(v))).collect(),
            Values::Single(values) => values.into_iter().map(|v| metres(f64::from(v))).collect(),
            Values::Whole(values) | Values::Double(values) => values.into_iter().map(metres).collect(),
        };
        let cut_short = || DepthError::Damaged {
            format: "an image",
            problem: "it has fewer values than its header states".into(),
        };
        Image::from_pixels(self.width, self.height, pixels).ok_or_else(cut_short)
    }
}

/// Reads the values of a depth image.
///
/// # Errors
/// The bytes are of no format that is read, damaged, or no image of one number a pixel.
pub fn read(bytes: &[u8]) -> Result<RawDepth, DepthError> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => {
            let (width, height, values) = depth_png::values(bytes)?;
            RawDepth::new(width, height, Values::Short(values))
        }
        [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => tiff::read(bytes),
        [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => numpy::read_array(bytes),
        [b'P', b'K', 3, 4, ..] => numpy::read_archive(bytes),
        _ => Err(DepthError::Unknown),
    }
}

fn check_size(width: usize, height: usize) -> Result<(), DepthError> {
    let sides = 1..=MOST_SIDE;
    if width == 0 || height == 0 {
        let found = format!("{width} x {height} pixels");
        return Err(DepthError::Kind { format: "file", found, wanted: "at least one pixel" });
    }
    if !(sides.contains(&width) && sides.contains(&height) && width * height <= MOST_PIXELS) {
        return Err(DepthError::TooLarge { width, height });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
