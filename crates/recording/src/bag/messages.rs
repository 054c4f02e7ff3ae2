//! Messages of package `sensor_msgs`.

use orchard_geometry::DepthImage;
use serde::Serialize;

use super::cdr::Reader;

/// Names of the schemas.
pub(super) const IMAGE: &str = "sensor_msgs/msg/Image";
pub(super) const CAMERA_INFO: &str = "sensor_msgs/msg/CameraInfo";

/// Most pixels of an image.
const MOST_PIXELS: u64 = 100_000_000;

/// Time and frame of a message.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ImageHeader {
    /// Seconds and nanoseconds of the stamp.
    pub stamp: (i32, u32),
    /// Name of the frame of reference.
    pub frame_id: String,
}

/// Image of depths, as sent.
#[derive(Debug, Clone, PartialEq)]
pub struct RosImage {
    /// Time and frame.
    pub header: ImageHeader,
    /// Columns and rows.
    pub size: (usize, usize),
    encoding: Encoding,
    big_endian: bool,
    /// Bytes of a row.
    step: usize,
    data: Vec<u8>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Encoding {
    /// 16 bits, usually millimetres (REP 118).
    Whole,
    /// 32-bit floating-point metres.
    Single,
}

impl Encoding {
    fn bytes(self) -> usize {
        match self {
            Encoding::Whole => 2,
            Encoding::Single => 4,
        }
    }
}

fn header(cdr: &mut Reader<'_>) -> Result<ImageHeader, String> {
    Ok(ImageHeader { stamp: (cdr.i32()?, cdr.u32()?), frame_id: cdr.text()? })
}

impl RosImage {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, String> {
        let mut cdr = Reader::new(bytes)?;
        let header = header(&mut cdr)?;
        let (height, width) = (cdr.u32()?, cdr.u32()?);
        let name = cdr.text()?;
        let encoding = match name.as_str() {
            "16UC1" | "mono16" => Encoding::Whole,
            "32FC1" => Encoding::Single,
            _ => return Err(format!("encoding is {name}; 16UC1, mono16 or 32FC1 is needed")),
        };
        let big_endian = cdr.u8()? != 0;
        let step = cdr.u32()? as usize;
        let length = cdr.u32()? as usize;
        let data = cdr.bytes(length)?;
        if width == 0 || height == 0 || u64::from(width) * u64::from(height) > MOST_PIXELS {
            return Err(format!("is {width} x {height}; 1 to {MOST_PIXELS} pixels are read"));
        }
        let size = (width as usize, height as usize);
        if step < size.0 * encoding.bytes() || length < step.saturating_mul(size.1) {
            return Err(format!(
                "step {step} and {length} bytes do not hold {width} x {height} pixels of {name}"
            ));
        }
        Ok(Self { header, size, encoding, big_endian, step, data: data.to_vec() })
    }

    /// The usual unit \[m\]: a millimetre for whole numbers, a metre for floating-point numbers (REP 118).
    pub fn usual_unit(&self) -> f64 {
        match self.encoding {
            Encoding::Whole => 1e-3,
            Encoding::Single => 1.0,
        }
    }

    /// Image in metres; `unit` \[m\] is the depth of value 1. What is not positive and finite is no measurement, 0.
    pub fn depth(&self, unit: f64) -> DepthImage {
        let mut out = DepthImage::filled(self.size.0, self.size.1, 0.0);
        let n = self.encoding.bytes();
        for (v, row) in self.data.chunks(self.step).take(self.size.1).enumerate() {
            for (u, bytes) in row.chunks_exact(n).take(self.size.0).enumerate() {
                let mut ordered = [0; 4];
                ordered[..n].copy_from_slice(bytes);
                if self.big_endian {
                    ordered[..n].reverse();
                }
                let value = match self.encoding {
                    Encoding::Whole => f64::from(u16::from_le_bytes([ordered[0], ordered[1]])),
                    Encoding::Single => f64::from(f32::from_le_bytes(ordered)),
                };
                let z = (value * unit) as f32;
                out[(u, v)] = if z.is_finite() && z > 0.0 { z } else { 0.0 };
            }
        }
        out
    }
}

/// Intrinsics, with the names of the message's fields.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CameraInfo {
    /// Rows.
    pub height: u32,
    /// Columns.
    pub width: u32,
    /// Name of the model of distortion.
    pub distortion_model: String,
    /// Coefficients of distortion.
    pub d: Vec<f64>,
    /// Matrix of the pinhole, row by row.
    pub k: [f64; 9],
}

impl CameraInfo {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, String> {
        let mut cdr = Reader::new(bytes)?;
        header(&mut cdr)?;
        let (height, width) = (cdr.u32()?, cdr.u32()?);
        let distortion_model = cdr.text()?;
        let length = cdr.u32()?;
        // Every number is there, or reading ends with an error: no memory is taken for more.
        let mut d = Vec::new();
        for _ in 0..length {
            d.push(cdr.f64()?);
        }
        let mut k = [0.0; 9];
        for value in &mut k {
            *value = cdr.f64()?;
        }
        Ok(Self { height, width, distortion_model, d, k })
    }
}
