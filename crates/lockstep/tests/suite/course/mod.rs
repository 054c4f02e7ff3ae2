//! Worlds that take several frames at once.

use orchard_lockstep::Span;
use orchard_robot::Command;
use orchard_world::World;

/// A world with the commands of some frames, of which some are taken.
pub struct Course<'a> {
    pub lane: usize,
    pub world: &'a mut World,
    pub commands: Vec<Command>,
    pub taken: usize,
}

impl Span for Course<'_> {
    fn lane(&self) -> usize {
        self.lane
    }

    fn frames(&mut self) -> (&mut World, &[Command]) {
        (self.world, &self.commands[self.taken..])
    }

    fn is_whole(&self) -> bool {
        false
    }

    fn after_frame(&mut self) -> bool {
        self.taken += 1;
        true
    }
}
