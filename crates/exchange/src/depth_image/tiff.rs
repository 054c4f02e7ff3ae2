//! Depth images as TIFF: one number a pixel, the first image of the file.

use std::io::Cursor;

use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};

use super::{DepthError, RawDepth, Values, check_size};
use crate::intrinsics::MOST_PIXELS;

const FORMAT: &str = "TIFF";

pub(super) fn read(bytes: &[u8]) -> Result<RawDepth, DepthError> {
    let damaged = |e: tiff::TiffError| DepthError::Damaged { format: FORMAT, problem: e.to_string() };
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MOST_PIXELS * size_of::<f64>();
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(damaged)?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(damaged)?;
    let (width, height) = (width as usize, height as usize);
    check_size(width, height)?;
    let kind = decoder.colortype().map_err(damaged)?;
    let wanted = "one number a pixel, of 16 or 32 bits or floating-point,";
    if !matches!(kind, ColorType::Gray(_)) {
        return Err(DepthError::Kind { format: FORMAT, found: format!("{kind:?}").to_lowercase(), wanted });
    }
    let doubles = |values: Vec<u32>| values.into_iter().map(f64::from).collect();
    let values = match decoder.read_image().map_err(damaged)? {
        DecodingResult::U16(values) => Values::Short(values),
        DecodingResult::U32(values) => Values::Whole(doubles(values)),
        DecodingResult::I16(values) => Values::Whole(values.into_iter().map(f64::from).collect()),
        DecodingResult::I32(values) => Values::Whole(values.into_iter().map(f64::from).collect()),
        DecodingResult::F32(values) => Values::Single(values),
        DecodingResult::F64(values) => Values::Double(values),
        _ => {
            return Err(DepthError::Kind {
                format: FORMAT,
                found: format!("{kind:?}").to_lowercase(),
                wanted,
            });
        }
    };
    RawDepth::new(width, height, values)
}
