//! Reads recordings. Every checksum is checked on the way; a file that is cut off, damaged or of something else is an error.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, parse_record};
use orchard_input::InputError;
use orchard_robot::Command;
use orchard_tasks::harvest::episode::EpisodeKey;
use serde_json::Value;

use crate::channel::Channel;
use crate::command::CommandMessage;
use crate::file::{FIELDS, FORMAT, Header, METADATA, RECORD};
use crate::sink::Message;

/// A recording that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// No such file, or none that may be read.
    #[error("{path}: {source}")]
    Io {
        /// File.
        path: PathBuf,
        /// Cause.
        source: InputError,
    },
    /// Not an MCAP file.
    #[error("{path}: not an MCAP file")]
    NotMcap {
        /// File.
        path: PathBuf,
    },
    /// An MCAP file, but not as it was written.
    #[error("{path}: the file is cut off or damaged: {problem}")]
    Damaged {
        /// File.
        path: PathBuf,
        /// Problem found.
        problem: String,
    },
    /// An MCAP file of something else.
    #[error("{path}: not a recording of an episode: {problem}")]
    Foreign {
        /// File.
        path: PathBuf,
        /// Problem found.
        problem: String,
    },
    /// Written by other code.
    #[error("{path}: recorded {what} {recorded}, this is {here}")]
    Other {
        /// File.
        path: PathBuf,
        /// Property that differs.
        what: &'static str,
        /// Value in the recording.
        recorded: String,
        /// Value in this code.
        here: String,
    },
}

impl RecordingError {
    /// The error of an episode's recording with a sentence that says what to do.
    pub fn advised(&self) -> String {
        let advice = match self {
            Self::Io { .. } => return self.to_string(),
            Self::NotMcap { .. } | Self::Foreign { .. } => {
                "recordings of episodes stand in the folder recordings of a result of orchard bench-v1 --record"
            }
            Self::Damaged { .. } => "copy it again, or record the episode again by orchard bench-v1 --record",
            Self::Other { .. } => {
                "take the program that recorded it, or record the episode again by orchard bench-v1 --record"
            }
        };
        format!("{self}; {advice}")
    }
}

/// A whole recording.
#[derive(Debug, Clone)]
pub struct Recording {
    path: PathBuf,
    header: Header,
    record: Vec<u8>,
    messages: BTreeMap<Channel, u64>,
}

impl Recording {
    /// Reads a file through once.
    ///
    /// # Errors
    /// The file cannot be read, is cut off or damaged, or is not a recording.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        Self::read(path, Records::open(path)?)
    }

    /// Reads a recording from bytes; `path` names it in errors.
    ///
    /// # Errors
    /// The bytes are cut off or damaged, or are not a recording.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, RecordingError> {
        Self::read(path, Records::new(path, bytes, bytes.len() as u64))
    }

    fn read<R: Read>(path: &Path, mut records: Records<R>) -> Result<Self, RecordingError> {
        let (mut header, mut attached, mut messages) = (None, None, BTreeMap::new());
        while let Some(piece) = records.next_piece()? {
            match piece {
                Piece::Metadata(fields) => header = Some(read_header(path, &fields)?),
                Piece::Attachment(data) => attached = Some(data),
                Piece::Message(message) => *messages.entry(message.channel).or_insert(0) += 1,
            }
        }
        let foreign =
            |problem: &str| RecordingError::Foreign { path: path.to_owned(), problem: problem.to_owned() };
        Ok(Self {
            path: path.to_owned(),
            header: header.ok_or_else(|| foreign("it names no episode"))?,
            record: attached.ok_or_else(|| foreign("the episode's record is not attached"))?,
            messages,
        })
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Inputs that determine the recording.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The episode's record, as attached.
    pub fn record(&self) -> &[u8] {
        &self.record
    }

    /// Number of messages by channel.
    pub fn counts(&self) -> &BTreeMap<Channel, u64> {
        &self.messages
    }

    /// Checks that this code, with these configs, would write the same recording.
    ///
    /// # Errors
    /// The recording was written by another version, or under other configs; the error names both.
    pub fn check(&self, here: &Header) -> Result<(), RecordingError> {
        let (there, path) = (&self.header, &self.path);
        let (a, b) = (&there.key, &here.key);
        let pairs = [
            ("with code version", &a.code_version, &b.code_version),
            ("under the configs", &a.config_hash, &b.config_hash),
            ("with the recording's config", &there.config, &here.config),
        ];
        let known = (a.schema_version, b.schema_version);
        if known.0 != known.1 {
            return Err(other(path, "with schema version", known.0.to_string(), known.1.to_string()));
        }
        match pairs.into_iter().find(|(_, recorded, here)| recorded != here) {
            Some((what, recorded, here)) => Err(other(path, what, recorded.clone(), here.clone())),
            None => Ok(()),
        }
    }

    /// Returns the command of every frame, from the first.
    ///
    /// # Errors
    /// The file cannot be opened or read, or a command in it is none.
    pub fn commands(&self) -> Result<Vec<Command>, RecordingError> {
        let none = |problem: String| RecordingError::Foreign { path: self.path.clone(), problem };
        let mut commands = Vec::new();
        for message in self.messages()? {
            let message = message?;
            if message.channel == Channel::Command {
                let read = serde_json::from_slice::<CommandMessage>(&message.data).ok();
                let command = read.and_then(|read| Command::try_from(&read).ok());
                let frame = commands.len();
                commands.push(
                    command.ok_or_else(|| none(format!("frame {frame} has no command that can be read")))?,
                );
            }
        }
        Ok(commands)
    }

    /// Returns the messages, in the order of the file.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn messages(&self) -> Result<Messages, RecordingError> {
        Records::open(&self.path).map(Messages)
    }
}

fn other(path: &Path, what: &'static str, recorded: String, here: String) -> RecordingError {
    RecordingError::Other { path: path.to_owned(), what, recorded, here }
}

/// The messages of a file.
pub struct Messages(Records<BufReader<File>>);

impl Iterator for Messages {
    type Item = Result<Message, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.0.next_piece().transpose()? {
                Ok(Piece::Message(message)) => return Some(Ok(message)),
                Ok(_) => {}
                Err(e) => return Some(Err(e)),
            }
        }
    }
}

/// Part of a file that the reader uses.
enum Piece {
    /// Fields of the metadata record that names the episode.
    Metadata(BTreeMap<String, String>),
    Message(Message),
    /// The episode's record.
    Attachment(Vec<u8>),
}

/// A file, record by record.
struct Records<R> {
    path: PathBuf,
    file: R,
    reader: LinearReader,
    channels: BTreeMap<u16, Channel>,
}

impl Records<BufReader<File>> {
    fn open(path: &Path) -> Result<Self, RecordingError> {
        let opened = orchard_input::open(path, orchard_input::RECORDING);
        let (file, length) = opened.map_err(|source| RecordingError::Io { path: path.to_owned(), source })?;
        Ok(Self::new(path, BufReader::new(file), length))
    }
}

impl<R: Read> Records<R> {
    fn new(path: &Path, file: R, length: u64) -> Self {
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_check_finishes_after_end_magic(true)
            // A damaged length asks for no more memory than the file could fill.
            .with_record_length_limit(
                usize::try_from(length)
                    .unwrap_or(usize::MAX)
                    .saturating_mul(MOST_COMPRESSED)
                    .min(LONGEST_RECORD),
            );
        let reader = LinearReader::new_with_options(options);
        Self { path: path.to_owned(), file, reader, channels: BTreeMap::new() }
    }

    fn next_piece(&mut self) -> Result<Option<Piece>, RecordingError> {
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
                    if let Some(piece) = piece(&self.path, &mut self.channels, record)? {
                        return Ok(Some(piece));
                    }
                }
            }
        }
    }
}

/// Longest record and largest uncompressed chunk \[bytes\], our own choice: our chunks have 1 MB, and the record of an episode of 600 s
/// has some MB.
const LONGEST_RECORD: usize = 64 << 20;
/// Largest ratio of a chunk's uncompressed size to the size of the whole file: still scenes compress well.
const MOST_COMPRESSED: usize = 1000;

fn piece(
    path: &Path,
    channels: &mut BTreeMap<u16, Channel>,
    record: Record<'_>,
) -> Result<Option<Piece>, RecordingError> {
    let foreign = |problem| RecordingError::Foreign { path: path.to_owned(), problem };
    Ok(match record {
        Record::Channel(channel) => {
            let known = Channel::of(&channel.topic);
            let known = known.ok_or_else(|| foreign(format!("unknown topic {}", channel.topic)))?;
            channels.insert(channel.id, known);
            None
        }
        Record::Message { header, data } => {
            let channel = channels.get(&header.channel_id).copied();
            let channel = channel.ok_or_else(|| foreign("a message without a channel".to_owned()))?;
            Some(Piece::Message(Message { channel, log_time: header.log_time, data: data.into_owned() }))
        }
        Record::Metadata(metadata) if metadata.name == METADATA => Some(Piece::Metadata(metadata.metadata)),
        Record::Attachment { header, data, .. } if header.name == RECORD => {
            Some(Piece::Attachment(data.into_owned()))
        }
        _ => None,
    })
}

/// An error of the format, in words.
pub(crate) fn problem(path: &Path, e: McapError) -> RecordingError {
    let path = path.to_owned();
    match e {
        McapError::BadMagic => RecordingError::NotMcap { path },
        McapError::Io(e) => RecordingError::Io { path, source: e.into() },
        e => RecordingError::Damaged { path, problem: e.to_string() },
    }
}

fn read_header(path: &Path, fields: &BTreeMap<String, String>) -> Result<Header, RecordingError> {
    let foreign = |problem: String| RecordingError::Foreign { path: path.to_owned(), problem };
    let field =
        |name: &str| fields.get(name).ok_or_else(|| foreign(format!("no field {name} in {METADATA}")));
    let [format, key, config, scenario] = FIELDS;
    let format = field(format)?;
    if *format != FORMAT.to_string() {
        return Err(other(path, "in format", format.clone(), FORMAT.to_string()));
    }
    let text = field(key)?;
    let key = serde_json::from_str::<EpisodeKey>(text).map_err(|e| {
        // The key of another schema version may have other fields; then the version is the error to report.
        let version = serde_json::from_str::<Value>(text).ok();
        match version.and_then(|key| key["code_version"].as_str().map(str::to_owned)) {
            Some(code) if code != orchard_bench::CODE_VERSION => {
                other(path, "with code version", code, orchard_bench::CODE_VERSION.to_owned())
            }
            _ => foreign(format!("its key does not read: {e}")),
        }
    })?;
    let scenario = serde_json::from_str(field(scenario)?)
        .map_err(|e| foreign(format!("its scenario does not read: {e}")))?;
    Ok(Header { format: FORMAT, key, config: field(config)?.clone(), scenario })
}
