//! A recorded episode: a world that recorded commands drive, with moments to which it goes back.

use std::collections::BTreeMap;
use std::sync::Arc;

use orchard_picker::{Controller, Record};
use orchard_play::{Make, Session};
use orchard_robot::{Command, Observation};
use orchard_world::{Snapshot, World};

/// Frames between two moments that are kept.
const KEPT: u32 = 60;

/// Returns the recorded commands, frame by frame, and after the last one that again. It believes nothing: its record stays empty.
struct Player {
    commands: Arc<[Command]>,
    frame_time: f64,
    record: Record,
}

impl Controller for Player {
    fn act(&mut self, seen: &Observation) -> Command {
        let frame = (seen.time / self.frame_time).round() as usize;
        let command = self.commands.get(frame).or(self.commands.last());
        command.copied().unwrap_or_else(|| Command::still(seen))
    }

    fn record(&self) -> &Record {
        &self.record
    }
}

/// The commands of an episode, and moments of its world so far.
pub(crate) struct Reel {
    commands: Arc<[Command]>,
    moments: BTreeMap<u32, Snapshot>,
    /// True since a person or another driver took part: what follows is not the recorded episode.
    changed: bool,
}

impl Reel {
    /// The reel of an episode whose world stands at its start.
    pub fn new(commands: Vec<Command>, world: &World) -> Self {
        let moments = BTreeMap::from([(world.frame(), world.snapshot())]);
        Self { commands: commands.into(), moments, changed: false }
    }

    /// Frames of the episode.
    pub fn frames(&self) -> u32 {
        self.commands.len() as u32
    }

    /// True while the world is that of the recording.
    pub fn is_true(&self) -> bool {
        !self.changed
    }

    /// Makes drivers that return the recorded commands.
    pub fn make(&self, world: &World) -> Make {
        let (commands, frame_time) = (self.commands.clone(), world.spec().sim.frame());
        Box::new(move || -> Box<dyn Controller> {
            Box::new(Player { commands: commands.clone(), frame_time, record: Record::default() })
        })
    }

    /// Keeps the moment that a session has reached, if it is one to keep and the world is that of the recording. `by_reel` says that the recorded
    /// commands drove.
    pub fn keep(&mut self, session: &Session, by_reel: bool) {
        self.changed |= !by_reel || session.is_taken_over() || session.pull().is_some();
        let frame = session.world().frame();
        if !self.changed && frame.is_multiple_of(KEPT) && !self.moments.contains_key(&frame) {
            self.moments.insert(frame, session.world().snapshot());
        }
    }

    /// Brings a session to a frame of the episode: to the moment before it, and by steps from there.
    ///
    /// # Errors
    /// The moments are of another world.
    pub fn seek(&mut self, session: &mut Session, frame: u32) -> Result<(), String> {
        let frame = frame.min(self.frames());
        let Some((_, moment)) = self.moments.range(..=frame).next_back() else { return Ok(()) };
        let is_before = !self.changed && (moment.frame()..=frame).contains(&session.world().frame());
        if !is_before {
            session.restore(moment).map_err(|e| e.to_string())?;
            self.changed = false;
        }
        while session.world().frame() < frame {
            session.step();
            self.keep(session, true);
        }
        Ok(())
    }
}
