//! Colour images as cameras and people keep them: PNG and JPEG, of 8 or 16 bits, grey of 8 bits or with transparency, read as sRGB of 8 bits.

use orchard_geometry::Image;
use png::{BitDepth, ColorType, Decoder, Limits, Transformations};
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

use crate::intrinsics::{MOST_PIXELS, MOST_SIDE};

/// Error of reading a colour image.
#[derive(Debug, thiserror::Error)]
pub enum ColourError {
    /// The file is damaged or truncated.
    #[error("cannot be read as {format}: {problem}")]
    Damaged {
        /// Format by the first bytes.
        format: &'static str,
        /// Problem.
        problem: String,
    },
    /// The image is too large.
    #[error("is {width} x {height}; at most {MOST_SIDE} px a side and {MOST_PIXELS} px in all are read")]
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The image is grey with 16 bits, as depth images are.
    #[error("is grey with 16 bits, as depth images are; a colour image is needed")]
    Depth,
    /// The first bytes are of no format that is read.
    #[error("is no PNG or JPEG file by its first bytes")]
    Unknown,
}

/// Reads a colour image.
///
/// # Errors
/// The bytes are no PNG and no JPEG, damaged, those of a depth image, or of too large an image.
pub fn read(bytes: &[u8]) -> Result<Image<[u8; 3]>, ColourError> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => read_png(bytes),
        [0xff, 0xd8, 0xff, ..] => read_jpeg(bytes),
        _ => Err(ColourError::Unknown),
    }
}

fn check(width: usize, height: usize) -> Result<(), ColourError> {
    if width > MOST_SIDE || height > MOST_SIDE || width * height > MOST_PIXELS {
        return Err(ColourError::TooLarge { width, height });
    }
    Ok(())
}

fn image(
    format: &'static str,
    size: (usize, usize),
    pixels: Vec<[u8; 3]>,
) -> Result<Image<[u8; 3]>, ColourError> {
    let cut =
        || ColourError::Damaged { format, problem: "it has fewer pixels than its header states".into() };
    Image::from_pixels(size.0, size.1, pixels).ok_or_else(cut)
}

/// Largest memory of the decoder besides the image itself \[bytes\].
const DECODER_MEMORY: usize = 1 << 26;

fn read_png(bytes: &[u8]) -> Result<Image<[u8; 3]>, ColourError> {
    const FORMAT: &str = "PNG";
    let damaged = |e: png::DecodingError| ColourError::Damaged { format: FORMAT, problem: e.to_string() };
    let mut decoder = Decoder::new_with_limits(std::io::Cursor::new(bytes), Limits { bytes: DECODER_MEMORY });
    decoder.set_transformations(Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(damaged)?;
    let size = (reader.info().width as usize, reader.info().height as usize);
    check(size.0, size.1)?;
    if (reader.info().color_type, reader.info().bit_depth) == (ColorType::Grayscale, BitDepth::Sixteen) {
        return Err(ColourError::Depth);
    }
    let too_large = ColourError::TooLarge { width: size.0, height: size.1 };
    let mut data = vec![0; reader.output_buffer_size().ok_or(too_large)?];
    reader.next_frame(&mut data).map_err(damaged)?;
    let pixels = match reader.output_color_type().0 {
        ColorType::Grayscale => data.iter().map(|&g| [g; 3]).collect(),
        ColorType::GrayscaleAlpha => data.as_chunks::<2>().0.iter().map(|&[g, _]| [g; 3]).collect(),
        ColorType::Rgba => data.as_chunks::<4>().0.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
        _ => data.as_chunks::<3>().0.to_vec(),
    };
    image(FORMAT, size, pixels)
}

fn read_jpeg(bytes: &[u8]) -> Result<Image<[u8; 3]>, ColourError> {
    const FORMAT: &str = "JPEG";
    let damaged = |problem: String| ColourError::Damaged { format: FORMAT, problem };
    let options = DecoderOptions::default()
        .set_max_width(MOST_SIDE)
        .set_max_height(MOST_SIDE)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|e| damaged(e.to_string()))?;
    let size = decoder.dimensions().ok_or_else(|| damaged("it has no size".into()))?;
    check(size.0, size.1)?;
    let data = decoder.decode().map_err(|e| damaged(e.to_string()))?;
    image(FORMAT, size, data.as_chunks::<3>().0.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image_png::{write_grey8, write_grey16, write_rgb};

    /// 8 x 8 pixels of one colour, (200, 40, 90), by Pillow.
    const JPEG: &[u8] = include_bytes!("../tests/files/red.jpg");

    #[test]
    fn pixels_are_those_of_the_file() {
        let rgb = Image::from_pixels(2, 1, vec![[1, 2, 3], [255, 0, 9]]).unwrap();
        assert_eq!(read(&write_rgb(&rgb).unwrap()).unwrap(), rgb);
        let grey = Image::from_pixels(1, 2, vec![7, 255]).unwrap();
        assert_eq!(read(&write_grey8(&grey).unwrap()).unwrap().pixels(), [[7; 3], [255; 3]]);
        let sixteen = Image::from_pixels(1, 1, vec![0x8000_u16]).unwrap();
        let line = read(&write_grey16(&sixteen).unwrap()).unwrap_err().to_string();
        assert!(line.starts_with("is grey with 16 bits, as depth images are"), "{line}");
        let red = read(JPEG).unwrap();
        assert_eq!((red.width(), red.height()), (8, 8));
        // Rounding of the conversion to luminance and colour differences and back.
        let near = |p: &[u8; 3]| p.iter().zip([200, 40, 90]).all(|(&a, b)| (i32::from(a) - b).abs() <= 2);
        assert!(red.pixels().iter().all(near), "{:?}", red.pixels()[0]);
    }

    #[test]
    fn errors_tell_the_format() {
        for (bytes, message) in [
            (&b"II*\0"[..], "is no PNG or JPEG file by its first bytes"),
            (&b""[..], "is no PNG or JPEG file by its first bytes"),
            (&JPEG[..20], "cannot be read as JPEG"),
            (&b"\x89PNG"[..], "cannot be read as PNG"),
        ] {
            let line = read(bytes).unwrap_err().to_string();
            assert!(line.contains(message), "{line}");
        }
    }
}
