//! Sinks for messages.

use foxglove::Encode;
use serde::Serialize;

use crate::channel::Channel;

/// A message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Channel of the message.
    pub channel: Channel,
    /// Log time: nanoseconds of the simulation from the start of the episode.
    pub log_time: u64,
    /// Bytes of the message.
    pub data: Vec<u8>,
}

/// Takes messages, in the order of time.
pub trait Sink {
    /// Takes a message.
    fn put(&mut self, message: Message);
}

impl Sink for Vec<Message> {
    fn put(&mut self, message: Message) {
        self.push(message);
    }
}

/// Passes each message to both sinks.
impl<A: Sink, B: Sink> Sink for (A, B) {
    fn put(&mut self, message: Message) {
        self.0.put(message.clone());
        self.1.put(message);
    }
}

/// The bytes of one of Foxglove's messages.
pub(crate) fn protobuf<M: Encode>(message: &M) -> Vec<u8> {
    let mut data = Vec::with_capacity(message.encoded_len().unwrap_or(0));
    match message.encode(&mut data) {
        Ok(()) => data,
        Err(e) => unreachable!("a list of bytes grows: {e}"),
    }
}

/// The bytes of one of this crate's messages, as JSON.
pub(crate) fn json(message: &impl Serialize) -> Vec<u8> {
    serde_json::to_vec(message).unwrap_or_else(|e| unreachable!("numbers and words are JSON: {e}"))
}
