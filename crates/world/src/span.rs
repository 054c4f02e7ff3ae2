//! Worlds with the next frames that they are to take.

use orchard_robot::Command;

use crate::World;

/// A world with its next frames, for those who advance many worlds together.
pub trait Span: Send {
    /// Place of the world among those that advance together.
    fn lane(&self) -> usize;
    /// The world, and the commands of its next frames, at least one. The commands are fixed: they do not depend on what happens in these frames. Unless something touches wood or fruit, the episode does not end before the last frame.
    fn frames(&mut self) -> (&mut World, &[Command]);
    /// True if wood and fruit are needed after the last frame; else they may be behind then ([`World::is_behind`]).
    fn is_whole(&self) -> bool;
    /// Is called at the end of each frame. From then on [`Self::frames`] gives the commands of the frames that are left. Returns false if the episode has ended, so that the world takes no more frames.
    fn after_frame(&mut self) -> bool {
        true
    }
}

/// A world's next frame.
#[derive(Debug)]
pub struct Turn<'a> {
    /// Place of the world.
    pub lane: usize,
    /// The world.
    pub world: &'a mut World,
    /// Command of the frame.
    pub command: Command,
    /// As [`Span::is_whole`].
    pub is_whole: bool,
}

impl Span for Turn<'_> {
    fn lane(&self) -> usize {
        self.lane
    }

    fn frames(&mut self) -> (&mut World, &[Command]) {
        (self.world, std::slice::from_ref(&self.command))
    }

    fn is_whole(&self) -> bool {
        self.is_whole
    }
}
