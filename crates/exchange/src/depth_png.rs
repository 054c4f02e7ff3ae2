//! Depth images as 16-bit grey PNG in the form of RealSense and ROS tools: depth = value x unit, 0 = no measurement.

use orchard_geometry::{DepthImage, Image};
use png::{BitDepth, ColorType, Decoder, Encoder, Limits, Transformations};

use crate::intrinsics::{MOST_PIXELS, MOST_SIDE};

/// The usual unit, a millimetre \[m\].
pub const MILLIMETRE: f64 = 1e-3;

/// Error of reading a PNG image of a required kind.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// The file is damaged, truncated or no PNG.
    #[error("cannot be read as PNG: {0}")]
    Damaged(String),
    /// The file is a PNG of another kind.
    #[error("is a PNG of {found}; {wanted} is needed")]
    Kind {
        /// Kind of the file.
        found: String,
        /// Kind that is required.
        wanted: &'static str,
    },
    /// The image is larger than any depth camera's.
    #[error("is {width} x {height}; at most {MOST_SIDE} px a side and {MOST_PIXELS} px in all are read")]
    TooLarge {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
}

/// Reads a depth image; `unit` \[m\] is the depth of value 1.
///
/// # Errors
/// The bytes are no PNG, a damaged one, or one that is not grey of 16 bits.
pub fn read(bytes: &[u8], unit: f64) -> Result<DepthImage, PngError> {
    let (width, height, values) = values(bytes)?;
    let pixels = values.into_iter().map(|value| (f64::from(value) * unit) as f32).collect();
    Image::from_pixels(width, height, pixels).ok_or_else(cut_short)
}

/// Columns, rows and values of a depth image.
pub(crate) fn values(bytes: &[u8]) -> Result<(usize, usize, Vec<u16>), PngError> {
    let raw = decode(bytes, &[(ColorType::Grayscale, BitDepth::Sixteen)], "grey of 16 bits")?;
    let values = raw.data.as_chunks::<2>().0.iter().map(|b| u16::from_be_bytes(*b)).collect();
    Ok((raw.width, raw.height, values))
}

fn cut_short() -> PngError {
    PngError::Damaged("it has fewer pixels than its header states".into())
}

/// Reads a mask from a grey image of 1 or 8 bits: true where it is not black.
///
/// # Errors
/// The bytes are no PNG, a damaged one, or one of another kind.
pub fn read_mask(bytes: &[u8]) -> Result<Image<bool>, PngError> {
    let kinds = [(ColorType::Grayscale, BitDepth::Eight), (ColorType::Grayscale, BitDepth::One)];
    let raw = decode(bytes, &kinds, "grey of 1 or 8 bits")?;
    let pixels = match raw.bits {
        BitDepth::One => {
            let row_bytes = raw.width.div_ceil(8);
            let bit = |i: usize| {
                raw.data[i / raw.width * row_bytes + i % raw.width / 8] >> (7 - i % raw.width % 8) & 1
            };
            (0..raw.width * raw.height).map(|i| bit(i) == 1).collect()
        }
        _ => raw.data.iter().map(|&value| value > 0).collect(),
    };
    raw.image(pixels)
}

/// Writes a depth image; `unit` \[m\] is the depth of value 1. Depths round to the nearest value. Depths that are not positive
/// numbers or exceed 65535 units are written as 0, no measurement.
///
/// # Errors
/// The image has no pixels or is too large for a PNG.
pub fn write(depth: &DepthImage, unit: f64) -> Result<Vec<u8>, png::EncodingError> {
    let data: Vec<u8> = depth.pixels().iter().flat_map(|z| value(*z, unit).to_be_bytes()).collect();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, depth.width() as u32, depth.height() as u32);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Sixteen);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&data)?;
    writer.finish()?;
    Ok(bytes)
}

/// Number of pixels that are measured and whose depth [`write()`] writes as 0, since it does not fit.
pub fn unfit(depth: &DepthImage, unit: f64) -> u64 {
    let is_unfit = |z: &&f32| **z > 0.0 && value(**z, unit) == 0;
    depth.pixels().iter().filter(is_unfit).count() as u64
}

/// The value of a depth: rounded, 0 if it is not positive or does not fit.
fn value(depth: f32, unit: f64) -> u16 {
    let steps = (f64::from(depth) / unit).round();
    if steps >= 1.0 && steps <= f64::from(u16::MAX) { steps as u16 } else { 0 }
}

/// First image of a file, as stored.
pub(crate) struct Raw {
    pub width: usize,
    pub height: usize,
    bits: BitDepth,
    pub data: Vec<u8>,
}

impl Raw {
    pub fn image<T>(&self, pixels: Vec<T>) -> Result<Image<T>, PngError> {
        Image::from_pixels(self.width, self.height, pixels).ok_or_else(cut_short)
    }
}

pub(crate) fn decode(
    bytes: &[u8],
    kinds: &[(ColorType, BitDepth)],
    wanted: &'static str,
) -> Result<Raw, PngError> {
    let damaged = |e: png::DecodingError| PngError::Damaged(e.to_string());
    let mut decoder = Decoder::new_with_limits(std::io::Cursor::new(bytes), Limits { bytes: DECODER_MEMORY });
    decoder.set_transformations(Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(damaged)?;
    let info = reader.info();
    let (width, height, bits) = (info.width, info.height, info.bit_depth);
    let kind = (info.color_type, bits);
    if !kinds.contains(&kind) {
        let found = format!("{:?} of {} bits", kind.0, bits as u8).to_lowercase();
        return Err(PngError::Kind { found, wanted });
    }
    let (columns, rows) = (width as usize, height as usize);
    if columns > MOST_SIDE || rows > MOST_SIDE || columns * rows > MOST_PIXELS {
        return Err(PngError::TooLarge { width, height });
    }
    let size = reader.output_buffer_size().ok_or(PngError::TooLarge { width, height })?;
    let mut data = vec![0; size];
    reader.next_frame(&mut data).map_err(damaged)?;
    Ok(Raw { width: width as usize, height: height as usize, bits, data })
}

/// Largest memory of the decoder besides the image itself \[bytes\].
const DECODER_MEMORY: usize = 1 << 26;

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(color: ColorType, bits: BitDepth, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, 9, 2);
        encoder.set_color(color);
        encoder.set_depth(bits);
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        bytes
    }

    #[test]
    fn depth_is_read_as_it_was_written_to_half_a_unit() {
        let pixels = vec![0.0, 0.3, 0.30049, 1.2346, 65.535, 65.536, -1.0, f32::NAN, f32::INFINITY, 4e-4];
        let depth = DepthImage::from_pixels(5, 2, pixels).unwrap();
        let read = read(&write(&depth, MILLIMETRE).unwrap(), MILLIMETRE).unwrap();
        assert_eq!(read.pixels(), [0.0, 0.3, 0.3, 1.235, 65.535, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!((read.width(), read.height()), (5, 2));
    }

    #[test]
    fn a_mask_is_true_where_it_is_not_black() {
        let eight: Vec<u8> = (0..18).map(|i| if i % 3 == 0 { 0 } else { i }).collect();
        let mask = read_mask(&encoded(ColorType::Grayscale, BitDepth::Eight, &eight)).unwrap();
        assert!((0..18).all(|i| mask.pixels()[i] == (i % 3 != 0)));
        let one = read_mask(&encoded(
            ColorType::Grayscale,
            BitDepth::One,
            &[0b1000_0001, 0b1000_0000, 0, 0b1000_0000],
        ));
        let expected = [0, 7, 8, 17];
        assert!((0..18).all(|i| one.as_ref().unwrap().pixels()[i] == expected.contains(&i)));
    }

    #[test]
    fn errors_name_the_kind_of_file() {
        let message = |bytes: &[u8]| read(bytes, MILLIMETRE).unwrap_err().to_string();
        let eight = encoded(ColorType::Grayscale, BitDepth::Eight, &[1; 18]);
        assert_eq!(message(&eight), "is a PNG of grayscale of 8 bits; grey of 16 bits is needed");
        let color = encoded(ColorType::Rgb, BitDepth::Eight, &[1; 54]);
        assert_eq!(message(&color), "is a PNG of rgb of 8 bits; grey of 16 bits is needed");
        assert!(message(b"P5 9 2 65535").starts_with("cannot be read as PNG"));
        assert!(message(b"").starts_with("cannot be read as PNG"));
        let whole = encoded(ColorType::Grayscale, BitDepth::Sixteen, &[7; 36]);
        assert!(read(&whole, MILLIMETRE).is_ok());
        for length in 0..whole.len() - 16 {
            assert!(message(&whole[..length]).starts_with("cannot be read as PNG"), "{length}");
        }
        assert!(read_mask(&whole).unwrap_err().to_string().contains("grey of 1 or 8 bits"));
    }
}
