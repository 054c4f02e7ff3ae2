//! Depth images from bags of ROS 2 in MCAP files, and detections written back as such a bag.
//!
//! Messages are in CDR, as `ros2 bag record --storage mcap` writes them: `sensor_msgs/msg/Image` of encoding 16UC1, mono16 or 32FC1, and
//! `sensor_msgs/msg/CameraInfo`. Detections become `vision_msgs/msg/Detection3DArray`.

mod cdr;
mod detections;
mod messages;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use mcap::parse_record;
use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

pub use detections::{Detected, DetectionBag};
pub use messages::{CameraInfo, ImageHeader, RosImage};

use crate::read::{RecordingError, problem};

/// Longest record and largest uncompressed chunk \[bytes\]: an image of 100 million pixels of 16 bits, with others around it.
const LONGEST_RECORD: usize = 256 << 20;

/// Message of one of the two topics that are read.
#[derive(Debug, Clone, PartialEq)]
pub enum BagMessage {
    /// Image on the depth topic.
    Image(RosImage),
    /// Message on the topic of the camera's intrinsics.
    Info(CameraInfo),
}

/// Bag that is read front to back.
pub struct Bag<R = BufReader<File>> {
    path: PathBuf,
    file: R,
    reader: LinearReader,
    image_topic: String,
    info_topic: String,
    schemas: BTreeMap<u16, String>,
    /// Topic of each channel, with the kind of its messages.
    channels: BTreeMap<u16, (String, String)>,
}

/// Topic of the intrinsics that belong to an image topic: `camera_info` in the same place.
pub fn info_topic_of(image_topic: &str) -> String {
    let place = image_topic.rsplit_once('/').map_or("", |(place, _)| place);
    format!("{place}/camera_info")
}

impl Bag {
    /// Opens a bag.
    ///
    /// # Errors
    /// There is no such file, or it cannot be read.
    pub fn open(path: &Path, image_topic: &str, info_topic: &str) -> Result<Self, RecordingError> {
        let opened = orchard_input::open(path, orchard_input::RECORDING);
        let (file, _) = opened.map_err(|source| RecordingError::Io { path: path.to_owned(), source })?;
        Ok(Self::new(path, BufReader::new(file), image_topic, info_topic))
    }
}

impl<R: Read> Bag<R> {
    /// Reads a bag from anything that gives bytes; `path` names it in errors.
    pub fn new(path: &Path, file: R, image_topic: &str, info_topic: &str) -> Self {
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(LONGEST_RECORD);
        Self {
            path: path.to_owned(),
            file,
            reader: LinearReader::new_with_options(options),
            image_topic: image_topic.to_owned(),
            info_topic: info_topic.to_owned(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
        }
    }

    /// Topics met so far, each with the kind of its messages.
    pub fn topics(&self) -> impl Iterator<Item = (&str, &str)> {
        self.channels.values().map(|(topic, kind)| (topic.as_str(), kind.as_str()))
    }

    /// The next message of the two topics, with its time in the log \[ns\]; `None` at the end.
    ///
    /// # Errors
    /// The file is damaged, or a message on a topic is of another kind.
    pub fn next_message(&mut self) -> Result<Option<(u64, BagMessage)>, RecordingError> {
        loop {
            let Some(event) = self.reader.next_event() else { return Ok(None) };
            match event.map_err(|e| problem(&self.path, e))? {
                LinearReadEvent::ReadRequest(wanted) => {
                    let read = self.file.read(self.reader.insert(wanted));
                    let read =
                        read.map_err(|e| RecordingError::Io { path: self.path.clone(), source: e.into() })?;
                    self.reader.notify_read(read);
                }
                LinearReadEvent::Record { data, opcode } => {
                    let record = parse_record(opcode, data).map_err(|e| problem(&self.path, e))?;
                    let topics = (self.image_topic.as_str(), self.info_topic.as_str());
                    let known = (&mut self.schemas, &mut self.channels);
                    match message(topics, known, record) {
                        Ok(Some(message)) => return Ok(Some(message)),
                        Ok(None) => {}
                        Err(text) => {
                            return Err(RecordingError::Foreign { path: self.path.clone(), problem: text });
                        }
                    }
                }
            }
        }
    }
}

type Known<'a> = (&'a mut BTreeMap<u16, String>, &'a mut BTreeMap<u16, (String, String)>);

fn message(
    (image_topic, info_topic): (&str, &str),
    (schemas, channels): Known<'_>,
    record: Record<'_>,
) -> Result<Option<(u64, BagMessage)>, String> {
    match record {
        Record::Schema { header, .. } => {
            schemas.insert(header.id, header.name);
        }
        Record::Channel(channel) => {
            let name = schemas.get(&channel.schema_id).map_or("messages without a schema", String::as_str);
            let kind = format!("{name} in {}", channel.message_encoding);
            for (topic, wanted) in [(image_topic, messages::IMAGE), (info_topic, messages::CAMERA_INFO)] {
                if channel.topic == topic && kind != format!("{wanted} in {ENCODING}") {
                    return Err(format!("topic {topic} holds {kind}; {wanted} in {ENCODING} is needed"));
                }
            }
            channels.insert(channel.id, (channel.topic, kind));
        }
        Record::Message { header, data } => {
            let topic = channels.get(&header.channel_id).map(|(topic, _)| topic.as_str());
            let told = |problem: String| {
                format!("message {} on {}: {problem}", header.sequence, topic.unwrap_or_default())
            };
            if topic == Some(image_topic) {
                let image = RosImage::read(&data).map_err(told)?;
                return Ok(Some((header.log_time, BagMessage::Image(image))));
            }
            if topic == Some(info_topic) {
                let info = CameraInfo::read(&data).map_err(told)?;
                return Ok(Some((header.log_time, BagMessage::Info(info))));
            }
        }
        _ => {}
    }
    Ok(None)
}

/// Encoding of messages of ROS 2.
const ENCODING: &str = "cdr";
