//! Colour images and images of whole numbers as PNG.

use orchard_geometry::Image;
use png::{BitDepth, ColorType, Encoder, EncodingError};

use crate::depth_png::{PngError, decode};

/// Writes a colour image (sRGB) of 8 bits a channel.
///
/// # Errors
/// The image has no pixels or is too large for a PNG.
pub fn write_rgb(image: &Image<[u8; 3]>) -> Result<Vec<u8>, EncodingError> {
    encode(image, ColorType::Rgb, BitDepth::Eight, image.pixels().as_flattened())
}

/// Writes a grey image of 8 bits.
///
/// # Errors
/// The image has no pixels or is too large for a PNG.
pub fn write_grey8(image: &Image<u8>) -> Result<Vec<u8>, EncodingError> {
    encode(image, ColorType::Grayscale, BitDepth::Eight, image.pixels())
}

/// Writes a grey image of 16 bits.
///
/// # Errors
/// The image has no pixels or is too large for a PNG.
pub fn write_grey16(image: &Image<u16>) -> Result<Vec<u8>, EncodingError> {
    let data: Vec<u8> = image.pixels().iter().flat_map(|value| value.to_be_bytes()).collect();
    encode(image, ColorType::Grayscale, BitDepth::Sixteen, &data)
}

/// Reads a colour image of 8 bits a channel.
///
/// # Errors
/// The bytes are no PNG, a damaged one, or one of another kind.
pub fn read_rgb(bytes: &[u8]) -> Result<Image<[u8; 3]>, PngError> {
    let raw = decode(bytes, &[(ColorType::Rgb, BitDepth::Eight)], "RGB of 8 bits")?;
    raw.image(raw.data.as_chunks::<3>().0.to_vec())
}

/// Reads a grey image of 8 bits.
///
/// # Errors
/// The bytes are no PNG, a damaged one, or one of another kind.
pub fn read_grey8(bytes: &[u8]) -> Result<Image<u8>, PngError> {
    let raw = decode(bytes, &[(ColorType::Grayscale, BitDepth::Eight)], "grey of 8 bits")?;
    raw.image(raw.data.clone())
}

fn encode<T>(
    image: &Image<T>,
    color: ColorType,
    bits: BitDepth,
    data: &[u8],
) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, image.width() as u32, image.height() as u32);
    encoder.set_color(color);
    encoder.set_depth(bits);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(data)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::depth_png;

    #[test]
    fn pixels_read_back() {
        let rgb = Image::from_pixels(2, 1, vec![[1, 2, 3], [255, 0, 9]]).unwrap();
        assert_eq!(read_rgb(&write_rgb(&rgb).unwrap()).unwrap(), rgb);
        let eight = Image::from_pixels(1, 2, vec![7, 255]).unwrap();
        assert_eq!(read_grey8(&write_grey8(&eight).unwrap()).unwrap(), eight);
        let sixteen = write_grey16(&Image::from_pixels(1, 2, vec![0x0102, 65535]).unwrap()).unwrap();
        assert_eq!(depth_png::read(&sixteen, 1.0).unwrap().pixels(), [258.0, 65535.0]);
        assert!(read_grey8(&sixteen).unwrap_err().to_string().contains("grey of 8 bits is needed"));
        assert!(write_grey8(&Image::filled(0, 3, 0)).is_err());
    }
}
