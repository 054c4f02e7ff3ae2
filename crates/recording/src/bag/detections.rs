//! Detections as a bag of `vision_msgs/msg/Detection3DArray`.

use std::collections::BTreeMap;
use std::io::{self, Cursor};

use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};

use super::cdr;
use super::{ENCODING, ImageHeader};

const NAME: &str = "vision_msgs/msg/Detection3DArray";
/// Definition of the message and of those within, as ROS 2 puts them together.
const SCHEMA: &str = include_str!("detection_3d_array.msg");
/// Class of a detection.
const CLASS: &str = "apple";

/// Fruit in an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Detected {
    /// Centre \[m, optical frame of the camera\].
    pub p_camera: [f64; 3],
    /// Radius \[m\].
    pub radius: f64,
    /// Score.
    pub score: f64,
    /// Standard deviation of the centre's distance from `p_camera` \[m\], if it is known.
    pub center_deviation: Option<f64>,
}

/// Bag that is written into memory.
pub struct DetectionBag {
    writer: Writer<Cursor<Vec<u8>>>,
    channel: u16,
    sequence: u32,
}

fn io_error(e: McapError) -> io::Error {
    match e {
        McapError::Io(e) => e,
        e => io::Error::other(e),
    }
}

impl DetectionBag {
    /// Begins a bag with one topic.
    ///
    /// # Errors
    /// The bag cannot be written.
    pub fn begin(topic: &str) -> io::Result<Self> {
        let options = WriteOptions::new()
            .profile("ros2")
            .compression(Some(Compression::Zstd))
            // With several threads the bytes differ.
            .compression_threads(0)
            .library(concat!("orchardbench ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(Cursor::new(Vec::new())).map_err(io_error)?;
        let schema = writer.add_schema(NAME, "ros2msg", SCHEMA.as_bytes()).map_err(io_error)?;
        let channel = writer.add_channel(schema, topic, ENCODING, &BTreeMap::new()).map_err(io_error)?;
        Ok(Self { writer, channel, sequence: 0 })
    }

    /// Writes the detections of one image, with the image's time in the log \[ns\].
    ///
    /// # Errors
    /// The bag cannot be written.
    pub fn add(&mut self, log_time: u64, header: &ImageHeader, found: &[Detected]) -> io::Result<()> {
        let message = MessageHeader {
            channel_id: self.channel,
            sequence: self.sequence,
            log_time,
            publish_time: log_time,
        };
        self.sequence += 1;
        self.writer.write_to_known_channel(&message, &encoded(header, found)).map_err(io_error)
    }

    /// Ends the bag and returns its bytes.
    ///
    /// # Errors
    /// The bag cannot be written.
    pub fn finish(mut self) -> io::Result<Vec<u8>> {
        self.writer.finish().map_err(io_error)?;
        Ok(self.writer.into_inner().into_inner())
    }
}

fn encoded(header: &ImageHeader, found: &[Detected]) -> Vec<u8> {
    let mut cdr = cdr::Writer::new();
    let stamp = |cdr: &mut cdr::Writer| {
        cdr.i32(header.stamp.0);
        cdr.u32(header.stamp.1);
        cdr.text(&header.frame_id);
    };
    stamp(&mut cdr);
    cdr.u32(found.len() as u32);
    for (number, d) in found.iter().enumerate() {
        stamp(&mut cdr);
        // One hypothesis.
        cdr.u32(1);
        cdr.text(CLASS);
        cdr.f64s(&[d.score]);
        cdr.f64s(&d.p_camera);
        // A ball has no direction: the unit quaternion (x, y, z, w).
        cdr.f64s(&[0.0, 0.0, 0.0, 1.0]);
        cdr.f64s(&covariance(d.center_deviation));
        // The box around the ball.
        cdr.f64s(&d.p_camera);
        cdr.f64s(&[0.0, 0.0, 0.0, 1.0]);
        cdr.f64s(&[2.0 * d.radius; 3]);
        cdr.text(&number.to_string());
    }
    cdr.finish()
}

/// Covariance of (x, y, z, three rotations), row by row: the variance of the distance in equal parts. An unknown one has -1 in its first
/// place, as in `sensor_msgs`.
fn covariance(deviation: Option<f64>) -> [f64; 36] {
    let mut all = [0.0; 36];
    match deviation {
        Some(deviation) => [0, 7, 14].into_iter().for_each(|i| all[i] = deviation * deviation / 3.0),
        None => all[0] = -1.0,
    }
    all
}
