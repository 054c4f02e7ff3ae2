//! Episodes played back from their command logs.

use std::path::Path;

use orchard_robot::io::{Command, Observation};

use crate::harvest::command_log::CommandLog;
use crate::harvest::episode::EpisodeKey;
use crate::harvest::interface::{BenchController, ControllerEvent};
use crate::harvest::run::WorldFactory;

/// A controller that plays back a log.
pub struct Playback {
    log: CommandLog,
    frame: usize,
    next_event: usize,
}

impl Playback {
    /// Plays a log from its first frame. Beyond its last frame the robot is told to keep still, so that a log that is too short gives
    /// another episode than the recorded one.
    pub fn new(log: CommandLog) -> Self {
        Self { log, frame: 0, next_event: 0 }
    }
}

impl BenchController for Playback {
    fn act(&mut self, observation: &Observation) -> Command {
        let command = self.log.commands.get(self.frame).copied();
        self.frame += 1;
        command.unwrap_or_else(|| Command::still(observation))
    }

    fn drain_log(&mut self) -> Vec<ControllerEvent> {
        let rest = self.log.events.get(self.next_event..).unwrap_or_default();
        let of_frame = |(frame, _): &&(u32, ControllerEvent)| (*frame as usize) < self.frame;
        let events: Vec<ControllerEvent> =
            rest.iter().take_while(of_frame).map(|(_, event)| event.clone()).collect();
        self.next_event += events.len();
        events
    }
}

/// Worlds with controllers that play the command logs of a result folder back.
pub struct Replays<'a, F> {
    factory: &'a F,
    root: &'a Path,
}

impl<'a, F> Replays<'a, F> {
    /// Plays the logs under a result folder in the worlds of a factory.
    pub fn new(factory: &'a F, root: &'a Path) -> Self {
        Self { factory, root }
    }
}

impl<F: WorldFactory> WorldFactory for Replays<'_, F> {
    type World = F::World;
    type Controller = Playback;

    fn build(&self, key: &EpisodeKey) -> Result<(F::World, Playback), String> {
        let (world, _) = self.factory.build(key)?;
        let log = CommandLog::read(self.root, key).map_err(|e| e.to_string())?;
        Ok((world, Playback::new(log)))
    }
}
