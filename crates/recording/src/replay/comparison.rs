//! Compares messages with those of a recording.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt;
use std::iter::Peekable;
use std::rc::Rc;

use crate::channel::{Channel, Origin};
use crate::read::{Messages, RecordingError};
use crate::sink::{Message, Sink};

/// Number of messages of a channel that agreed and that differed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Messages with the same bytes at the same time.
    pub agreed: u64,
    /// Messages with other bytes.
    pub differing: u64,
    /// Messages that were recorded, but are absent from the replay.
    pub missing: u64,
    /// Messages that are in the replay, but were not recorded.
    pub surplus: u64,
}

impl Tally {
    /// True if all messages agreed.
    pub fn is_clean(&self) -> bool {
        self.differing + self.missing + self.surplus == 0
    }
}

/// Kind of difference between a recorded message and the replay's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Differs {
    /// Other bytes.
    Bytes,
    /// The message was recorded, but is absent from the replay.
    Missing,
    /// The message is in the replay, but was not recorded.
    Surplus,
    /// The controller gives another command.
    OtherCommand,
    /// The recorded message is not a command.
    NoCommand,
}

/// A difference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Difference {
    /// Channel.
    pub channel: Channel,
    /// Log time: nanoseconds from the start of the episode.
    pub log_time: u64,
    /// Kind of difference.
    pub differs: Differs,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.differs {
            Differs::Bytes => "other bytes than recorded",
            Differs::Missing => "recorded, but not told this time",
            Differs::Surplus => "not recorded",
            Differs::OtherCommand => "the controller gives another command than recorded",
            Differs::NoCommand => "what was recorded is no command",
        };
        write!(f, "{} at {:.6} s: {what}", self.channel.topic(), self.log_time as f64 * 1e-9)
    }
}

/// Compares messages with those of a recording, moment by moment.
pub struct Comparison {
    recorded: Peekable<Messages>,
    /// The present moment.
    now: u64,
    /// Recorded messages of this moment that the replay has not produced yet.
    open: Vec<Message>,
    /// Difference of this moment's command, if the controller's differs from the recorded one or the recorded one is not a command.
    command: Option<Differs>,
    tallies: BTreeMap<Channel, Tally>,
    first: BTreeMap<Origin, Difference>,
    failed: Option<RecordingError>,
}

impl Comparison {
    pub fn new(recorded: Messages) -> Self {
        Self {
            recorded: recorded.peekable(),
            now: 0,
            open: Vec::new(),
            command: None,
            tallies: BTreeMap::new(),
            first: BTreeMap::new(),
            failed: None,
        }
    }

    /// The recorded command of a moment.
    pub fn command(&mut self, now: u64) -> Option<&[u8]> {
        self.advance(now);
        self.open.iter().find(|m| m.channel == Channel::Command).map(|m| m.data.as_slice())
    }

    /// Notes that the command of this moment is not the controller's.
    pub fn other_command(&mut self, differs: Differs) {
        self.command = Some(differs);
    }

    /// Ends the comparison and returns its tallies and first differences.
    #[expect(clippy::type_complexity, reason = "taken apart at once")]
    pub fn finish(
        &mut self,
    ) -> Result<(BTreeMap<Channel, Tally>, BTreeMap<Origin, Difference>), RecordingError> {
        self.advance(u64::MAX);
        self.close();
        match self.failed.take() {
            Some(e) => Err(e),
            None => Ok((std::mem::take(&mut self.tallies), std::mem::take(&mut self.first))),
        }
    }

    /// Goes to a moment; what was recorded before and is still open is missing.
    fn advance(&mut self, now: u64) {
        if now > self.now {
            self.close();
            self.now = now;
        }
        while let Some(next) = self.recorded.next_if(|m| m.as_ref().map_or(true, |m| m.log_time <= now)) {
            match next {
                Ok(message) if message.log_time < now => self.differ(&message, Differs::Missing),
                Ok(message) => self.open.push(message),
                Err(e) => self.failed = Some(e),
            }
        }
    }

    fn close(&mut self) {
        for message in std::mem::take(&mut self.open) {
            self.differ(&message, Differs::Missing);
        }
    }

    fn take(&mut self, message: &Message) {
        self.advance(message.log_time);
        let own = if message.channel == Channel::Command { self.command.take() } else { None };
        let Some(i) = self.open.iter().position(|open| open.channel == message.channel) else {
            return self.differ(message, own.unwrap_or(Differs::Surplus));
        };
        let open = self.open.remove(i);
        match own {
            Some(differs) => self.differ(message, differs),
            None if open.data == message.data => {
                self.tallies.entry(message.channel).or_default().agreed += 1;
            }
            None => self.differ(message, Differs::Bytes),
        }
    }

    fn differ(&mut self, message: &Message, differs: Differs) {
        let tally = self.tallies.entry(message.channel).or_default();
        match differs {
            Differs::Missing => tally.missing += 1,
            Differs::Surplus => tally.surplus += 1,
            _ => tally.differing += 1,
        }
        let difference = Difference { channel: message.channel, log_time: message.log_time, differs };
        self.first.entry(message.channel.origin()).or_insert(difference);
    }
}

/// A comparison with several owners.
pub struct Shared(pub Rc<RefCell<Comparison>>);

impl Sink for Shared {
    fn put(&mut self, message: Message) {
        self.0.borrow_mut().take(&message);
    }
}
