//! Depth and colour images from bags of ROS 2 in MCAP files, and detections written back as such a bag.
//!
//! Messages are in CDR, as `ros2 bag record --storage mcap` writes them: `sensor_msgs/msg/Image` (depth of encoding 16UC1, mono16 or 32FC1;
//! colour of rgb8, bgr8, rgba8, bgra8 or mono8), `sensor_msgs/msg/CompressedImage`, and `sensor_msgs/msg/CameraInfo`. Detections become
//! `vision_msgs/msg/Detection3DArray`.

mod cdr;
mod detections;
mod image;
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
pub use image::{ColourImage, PackedImage, RosImage};
pub use messages::{CameraInfo, ImageHeader};

use crate::read::{RecordingError, problem};

/// Longest record and largest uncompressed chunk \[bytes\]: an image of 100 million pixels of 16 bits, with others around it.
const LONGEST_RECORD: usize = 256 << 20;

/// Message of one of the topics that are read.
#[derive(Debug, Clone, PartialEq)]
pub enum BagMessage {
    /// Image on the depth topic.
    Image(RosImage),
    /// Packed image on the depth topic.
    PackedDepth(PackedImage),
    /// Image on the colour topic.
    Colour(ColourImage),
    /// Packed image on the colour topic.
    PackedColour(PackedImage),
    /// Message on the topic of the camera's intrinsics.
    Info(CameraInfo),
}

/// Topics that are read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Topics {
    /// Depth images.
    pub depth: String,
    /// Intrinsics.
    pub info: String,
    /// Colour images, if they are read.
    pub colour: Option<String>,
}

/// Content of a channel that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Content {
    Depth,
    PackedDepth,
    Colour,
    PackedColour,
    Info,
}

/// Channel of a bag.
#[derive(Debug, Clone)]
struct Channel {
    topic: String,
    /// Kind of its messages.
    kind: String,
    /// `None` if it is not read.
    content: Option<Content>,
}

/// Bag that is read front to back.
pub struct Bag<R = BufReader<File>> {
    path: PathBuf,
    file: R,
    reader: LinearReader,
    topics: Topics,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
}

/// Topic of the intrinsics that belong to an image topic: `camera_info` in the same place. Packed images are on a topic below that of the
/// image (`image_raw/compressedDepth`).
pub fn info_topic_of(image_topic: &str) -> String {
    let image = match image_topic.rsplit_once('/') {
        Some((image, transport)) if TRANSPORTS.contains(&transport) => image,
        _ => image_topic,
    };
    let place = image.rsplit_once('/').map_or("", |(place, _)| place);
    format!("{place}/camera_info")
}

/// Last parts of topics of packed images.
const TRANSPORTS: [&str; 2] = ["compressed", "compressedDepth"];

impl Bag {
    /// Opens a bag.
    ///
    /// # Errors
    /// There is no such file, or it cannot be read.
    pub fn open(path: &Path, topics: &Topics) -> Result<Self, RecordingError> {
        let opened = orchard_input::open(path, orchard_input::RECORDING);
        let (file, _) = opened.map_err(|source| RecordingError::Io { path: path.to_owned(), source })?;
        Ok(Self::new(path, BufReader::new(file), topics))
    }
}

impl<R: Read> Bag<R> {
    /// Reads a bag from anything that gives bytes; `path` names it in errors.
    pub fn new(path: &Path, file: R, topics: &Topics) -> Self {
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(LONGEST_RECORD);
        Self {
            path: path.to_owned(),
            file,
            reader: LinearReader::new_with_options(options),
            topics: topics.clone(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
        }
    }

    /// Topics met so far, each with the kind of its messages.
    pub fn topics(&self) -> impl Iterator<Item = (&str, &str)> {
        self.channels.values().map(|channel| (channel.topic.as_str(), channel.kind.as_str()))
    }

    /// The next message of the topics, with its time in the log \[ns\]; `None` at the end.
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
                    let known = (&mut self.schemas, &mut self.channels);
                    match message(&self.topics, known, record) {
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

type Known<'a> = (&'a mut BTreeMap<u16, String>, &'a mut BTreeMap<u16, Channel>);

fn message(
    topics: &Topics,
    (schemas, channels): Known<'_>,
    record: Record<'_>,
) -> Result<Option<(u64, BagMessage)>, String> {
    match record {
        Record::Schema { header, .. } => {
            schemas.insert(header.id, header.name);
        }
        Record::Channel(channel) => {
            let schema = schemas.get(&channel.schema_id).map(String::as_str);
            let content = content(topics, &channel.topic, schema, &channel.message_encoding)?;
            let kind = kind(schema, &channel.message_encoding);
            channels.insert(channel.id, Channel { topic: channel.topic, kind, content });
        }
        Record::Message { header, data } => {
            let Some(Channel { topic, content: Some(content), .. }) = channels.get(&header.channel_id) else {
                return Ok(None);
            };
            let message = match content {
                Content::Depth => RosImage::read(&data).map(BagMessage::Image),
                Content::PackedDepth => PackedImage::read(&data).map(BagMessage::PackedDepth),
                Content::Colour => ColourImage::read(&data).map(BagMessage::Colour),
                Content::PackedColour => PackedImage::read(&data).map(BagMessage::PackedColour),
                Content::Info => CameraInfo::read(&data).map(BagMessage::Info),
            };
            let told = |problem| format!("message {} on {topic}: {problem}", header.sequence);
            return message.map(|message| Some((header.log_time, message))).map_err(told);
        }
        _ => {}
    }
    Ok(None)
}

fn kind(schema: Option<&str>, encoding: &str) -> String {
    format!("{} in {encoding}", schema.unwrap_or("messages without a schema"))
}

/// Content of the messages on a topic; `None` if it is not read.
fn content(
    topics: &Topics,
    topic: &str,
    schema: Option<&str>,
    encoding: &str,
) -> Result<Option<Content>, String> {
    use messages::{CAMERA_INFO, COMPRESSED_IMAGE, IMAGE};
    let wanted: &[(&str, Content)] = if topic == topics.depth {
        &[(IMAGE, Content::Depth), (COMPRESSED_IMAGE, Content::PackedDepth)]
    } else if topic == topics.info {
        &[(CAMERA_INFO, Content::Info)]
    } else if topics.colour.as_deref() == Some(topic) {
        &[(IMAGE, Content::Colour), (COMPRESSED_IMAGE, Content::PackedColour)]
    } else {
        return Ok(None);
    };
    let found = wanted.iter().find(|(name, _)| Some(*name) == schema && encoding == ENCODING);
    let names: Vec<&str> = wanted.iter().map(|(name, _)| *name).collect();
    let refused = || {
        let (kind, names) = (kind(schema, encoding), names.join(" or "));
        format!("topic {topic} holds {kind}; {names} in {ENCODING} is needed")
    };
    found.map(|(_, content)| Some(*content)).ok_or_else(refused)
}

/// Encoding of messages of ROS 2.
const ENCODING: &str = "cdr";
