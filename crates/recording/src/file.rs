//! A recording as an MCAP file.

use std::collections::BTreeMap;
use std::io::{self, Write};

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use orchard_scenario::StoredScenario;
use orchard_tasks::harvest::episode::{EpisodeKey, EpisodeRecord};

use crate::channel::Channel;
use crate::sink::{Message, Sink};

/// Version of the layout of recordings.
pub const FORMAT: u32 = 2;
/// Name of the metadata record at the start of a recording.
pub const METADATA: &str = "orchardbench.episode";
/// Name of the episode's record, attached at the end.
pub const RECORD: &str = "episode.json";
/// Fields of the metadata.
pub(crate) const FIELDS: [&str; 4] = ["format", "key", "recording_config", "scenario"];

/// Inputs that determine a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// [`FORMAT`].
    pub format: u32,
    /// The episode.
    pub key: EpisodeKey,
    /// [`crate::RecordingConfig::hash`].
    pub config: String,
    /// The scenario, with all its figures.
    pub scenario: StoredScenario,
}

impl Header {
    /// Header of an episode that this code records.
    pub fn new(key: &EpisodeKey, config: String, scenario: StoredScenario) -> Self {
        Self { format: FORMAT, key: key.clone(), config, scenario }
    }

    fn metadata(&self) -> Metadata {
        let key = serde_json::to_string(&self.key).unwrap_or_else(|e| unreachable!("a key is JSON: {e}"));
        let scenario = serde_json::to_string(&self.scenario);
        let scenario = scenario.unwrap_or_else(|e| unreachable!("a scenario is JSON: {e}"));
        let values = [self.format.to_string(), key, self.config.clone(), scenario];
        let fields = FIELDS.map(str::to_owned).into_iter().zip(values);
        Metadata { name: METADATA.to_owned(), metadata: fields.collect() }
    }
}

/// Writes messages into an MCAP file, front to back: the bytes are a function of the messages.
pub struct FileSink<W: Write> {
    writer: Writer<NoSeek<W>>,
    channels: BTreeMap<Channel, u16>,
    sequence: BTreeMap<Channel, u32>,
    failed: Option<io::Error>,
}

impl<W: Write> FileSink<W> {
    /// Begins a file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn begin(out: W, header: &Header) -> io::Result<Self> {
        let options = WriteOptions::new()
            .compression(Some(Compression::Zstd))
            // Compress on the simulating thread: with several threads the bytes differ.
            .compression_threads(0)
            .disable_seeking(true)
            .library(concat!("orchardbench ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(NoSeek::new(out)).map_err(io_error)?;
        writer.write_metadata(&header.metadata()).map_err(io_error)?;
        let mut channels = BTreeMap::new();
        for channel in Channel::ALL {
            let schema = channel.schema();
            let id = writer.add_schema(&schema.name, &schema.encoding, &schema.data).map_err(io_error)?;
            let id = writer.add_channel(id, channel.topic(), channel.encoding(), &BTreeMap::new());
            channels.insert(channel, id.map_err(io_error)?);
        }
        Ok(Self { writer, channels, sequence: BTreeMap::new(), failed: None })
    }

    /// Attaches the episode's record, ends the file and returns the writer.
    ///
    /// # Errors
    /// The end of the file, or an earlier part, could not be written.
    pub fn end(mut self, record: &EpisodeRecord, log_time: u64) -> io::Result<W> {
        if let Some(e) = self.failed {
            return Err(e);
        }
        let attachment = Attachment {
            log_time,
            create_time: log_time,
            name: RECORD.to_owned(),
            media_type: "application/json".to_owned(),
            data: record_bytes(record).into(),
        };
        self.writer.attach(&attachment).map_err(io_error)?;
        self.writer.finish().map_err(io_error)?;
        Ok(self.writer.into_inner().into_inner())
    }

    fn write(&mut self, message: &Message) -> Result<(), McapError> {
        let sequence = self.sequence.entry(message.channel).or_insert(0);
        *sequence += 1;
        let header = MessageHeader {
            channel_id: self.channels[&message.channel],
            sequence: *sequence,
            log_time: message.log_time,
            publish_time: message.log_time,
        };
        self.writer.write_to_known_channel(&header, &message.data)
    }
}

impl<W: Write> Sink for FileSink<W> {
    fn put(&mut self, message: Message) {
        if self.failed.is_none() {
            self.failed = self.write(&message).map_err(io_error).err();
        }
    }
}

/// A record as it is attached.
pub(crate) fn record_bytes(record: &EpisodeRecord) -> Vec<u8> {
    serde_json::to_vec(record).unwrap_or_else(|e| unreachable!("a record is JSON: {e}"))
}

fn io_error(e: McapError) -> io::Error {
    match e {
        McapError::Io(e) => e,
        other => io::Error::other(other),
    }
}
