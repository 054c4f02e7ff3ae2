//! Messages of package `sensor_msgs`.

use serde::Serialize;

use super::cdr::Reader;

/// Names of the schemas.
pub(super) const IMAGE: &str = "sensor_msgs/msg/Image";
pub(super) const COMPRESSED_IMAGE: &str = "sensor_msgs/msg/CompressedImage";
pub(super) const CAMERA_INFO: &str = "sensor_msgs/msg/CameraInfo";

/// Time and frame of a message.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ImageHeader {
    /// Seconds and nanoseconds of the stamp.
    pub stamp: (i32, u32),
    /// Name of the frame of reference.
    pub frame_id: String,
}

pub(super) fn header(cdr: &mut Reader<'_>) -> Result<ImageHeader, String> {
    Ok(ImageHeader { stamp: (cdr.i32()?, cdr.u32()?), frame_id: cdr.text()? })
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
