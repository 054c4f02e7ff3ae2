//! The channels of a recording, live over Foxglove's websocket protocol.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use foxglove::websocket::{Capability, ChannelView, Client, ServerListener};
use foxglove::{
    ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, WebSocketServer,
    WebSocketServerHandle,
};

use crate::channel::Channel;
use crate::sink::{Message, Sink};

/// A server that cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error("{address}: cannot serve there: {problem}; is another program on this port?")]
pub struct LiveError {
    address: String,
    problem: FoxgloveError,
}

/// A server of the channels, to any number of clients.
pub struct Live {
    // Channels live as long as their context.
    _context: Arc<Context>,
    server: WebSocketServerHandle,
    board: Arc<Board>,
}

/// The channels, and the latest message of each that a client needs who comes late.
struct Board {
    channels: BTreeMap<Channel, Arc<RawChannel>>,
    latest: Mutex<BTreeMap<Channel, Message>>,
}

/// True for channels whose latest message draws all of its topic.
fn is_whole(channel: Channel) -> bool {
    matches!(
        channel,
        Channel::Ground
            | Channel::Wood
            | Channel::Leaves
            | Channel::Fruit
            | Channel::Robot
            | Channel::Depth
            | Channel::Calibration
            | Channel::DetectionSpheres
            | Channel::Target
    )
}

fn at(log_time: u64) -> PartialMetadata {
    PartialMetadata { log_time: Some(log_time) }
}

impl ServerListener for Board {
    fn on_subscribe(&self, client: Client, channel: ChannelView) {
        let latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        let message = Channel::of(channel.topic()).and_then(|channel| latest.get(&channel));
        if let Some(message) = message {
            let to = &self.channels[&message.channel];
            to.log_with_meta_to_sink(&message.data, at(message.log_time), client.sink_id());
        }
    }
}

impl Live {
    /// Serves the channels at an address; port 0 takes a free one.
    ///
    /// # Errors
    /// The address is no one of this machine, or another program has the port.
    pub fn open(host: &str, port: u16) -> Result<Self, LiveError> {
        let failed = |problem| LiveError { address: format!("{host}:{port}"), problem };
        let context = Context::new();
        let mut channels = BTreeMap::new();
        for channel in Channel::ALL {
            let builder = ChannelBuilder::new(channel.topic()).context(&context);
            let builder = builder.message_encoding(channel.encoding()).schema(channel.schema());
            channels.insert(channel, builder.build_raw().map_err(failed)?);
        }
        let board = Arc::new(Board { channels, latest: Mutex::default() });
        let server = WebSocketServer::new().name("OrchardBench").bind(host, port).context(&context);
        let server = server.capabilities([Capability::Time]).listener(board.clone());
        let server = server.start_blocking().map_err(failed)?;
        Ok(Self { _context: context, server, board })
    }

    /// The port.
    pub fn port(&self) -> u16 {
        self.server.port()
    }

    /// Number of clients.
    pub fn clients(&self) -> usize {
        self.server.client_count()
    }

    /// Begins another world: clients forget what they have seen.
    pub fn begin(&self) -> LiveSink {
        self.board.latest.lock().unwrap_or_else(PoisonError::into_inner).clear();
        self.server.clear_session(None);
        LiveSink { board: self.board.clone() }
    }

    /// Tells the time of the simulation \[ns\].
    pub fn tell_time(&self, time: u64) {
        self.server.broadcast_time(time);
    }
}

/// Sends messages to the clients.
pub struct LiveSink {
    board: Arc<Board>,
}

impl Sink for LiveSink {
    fn put(&mut self, message: Message) {
        let mut latest = self.board.latest.lock().unwrap_or_else(PoisonError::into_inner);
        self.board.channels[&message.channel].log_with_meta(&message.data, at(message.log_time));
        if is_whole(message.channel) {
            latest.insert(message.channel, message);
        }
    }
}
