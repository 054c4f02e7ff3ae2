//! Depth images as `image_transport` of ROS packs them into `sensor_msgs/CompressedImage`.

use super::{DepthError, RawDepth, Values};

/// Bytes before the PNG of the transport `compressedDepth`: a number for the kind of packing and two parameters of 32 bits.
const HEADER: usize = 12;
/// First bytes of a PNG.
const PNG: [u8; 4] = [0x89, b'P', b'N', b'G'];

/// Reads a packed depth image by the field `format` of its message.
///
/// The transport `compressedDepth` writes 12 bytes and a PNG of 16 bits. For encoding `32FC1` the PNG holds inverse depth: a value v > 0 is
/// the depth a / (v - b) \[m\], with a and b from the 12 bytes. The transport `compressed` writes a bare PNG for whole numbers.
///
/// # Errors
/// The image is packed in another way, or it is damaged.
pub fn read_transported(format: &str, data: &[u8]) -> Result<RawDepth, DepthError> {
    let needed = |wanted| {
        let found = format!("format \"{}\"", format.escape_debug());
        DepthError::Kind { format: "compressed image", found, wanted }
    };
    let damaged =
        |problem: &str| DepthError::Damaged { format: "compressedDepth", problem: problem.to_owned() };
    let has_header = format.contains("compressedDepth");
    let inverse = format.trim_start().starts_with("32FC1");
    if inverse && !has_header {
        return Err(needed("compressedDepth for values of 32FC1"));
    }
    let (header, image) = if has_header {
        data.split_first_chunk::<HEADER>().ok_or_else(|| damaged("it ends within its first 12 bytes"))?
    } else {
        (&[0; HEADER], data)
    };
    if !image.starts_with(&PNG) {
        return Err(needed("a PNG"));
    }
    let raw = super::read(image)?;
    match raw.values {
        Values::Short(values) if inverse => {
            let [_, _, _, _, a0, a1, a2, a3, b0, b1, b2, b3] = *header;
            let (a, b) = (f32::from_le_bytes([a0, a1, a2, a3]), f32::from_le_bytes([b0, b1, b2, b3]));
            if !(a.is_finite() && b.is_finite() && a > 0.0) {
                return Err(damaged(&format!(
                    "its parameters are {a} and {b}; finite numbers are needed, the first positive"
                )));
            }
            let depth = |v: u16| if v == 0 { 0.0 } else { a / (f32::from(v) - b) };
            RawDepth::new(raw.width, raw.height, Values::Single(values.into_iter().map(depth).collect()))
        }
        values => RawDepth::new(raw.width, raw.height, values),
    }
}
