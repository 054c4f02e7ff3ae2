//! Environments that advance together, frame by frame.

use std::time::Instant;

use orchard_policy::Motion;
use rayon::prelude::*;

use crate::error::EnvError;
use crate::mover::{Begun, Mover, Turn};
use crate::slot::{Shared, Slot, Stepping};

/// An environment in the midst of a step.
pub(crate) struct Member<'a> {
    pub lane: usize,
    /// Lane within the crew.
    pub seat: usize,
    pub slot: &'a mut Slot,
    pub motion: Motion,
    pub stepping: Stepping,
}

/// Environments whose frames are computed together.
#[derive(Default)]
pub(crate) struct Crew<'a> {
    pub members: Vec<Member<'a>>,
    /// True if a frame was begun and not ended.
    pub is_under_way: bool,
    begun: Option<Begun>,
}

impl Crew<'_> {
    /// Begins the next frame of the steps that go on, if there is one.
    ///
    /// # Errors
    /// The device was lost.
    pub fn begin(&mut self, number: usize, mover: &mut Mover, shared: &Shared) -> Result<(), EnvError> {
        let since = Instant::now();
        let turns = self.turns(shared);
        mover.note("turns", since);
        let goes_on = !turns.is_empty();
        let begun = if goes_on { mover.begin(number, turns)? } else { None };
        (self.is_under_way, self.begun) = (goes_on, begun);
        Ok(())
    }

    /// Ends the frame, and judges it.
    ///
    /// # Errors
    /// The device was lost.
    pub fn end(&mut self, number: usize, mover: &mut Mover, shared: &Shared) -> Result<(), EnvError> {
        let begun = self.begun.take();
        mover.end(number, self.turns(shared), begun)?;
        let since = Instant::now();
        self.members.par_iter_mut().for_each(|Member { slot, motion, stepping, .. }| {
            if let Some(frame) = stepping.next_frame(shared) {
                slot.after_frame(stepping, &motion.command(frame), shared);
            }
        });
        mover.note("judge", since);
        self.is_under_way = false;
        let due = self.members.iter_mut().filter(|member| member.stepping.is_image_due());
        let mut worlds: Vec<_> =
            due.filter_map(|member| Some((member.lane, member.slot.world_mut()?))).collect();
        if worlds.is_empty() { Ok(()) } else { mover.observe(&mut worlds).map(|_| ()) }
    }

    /// Frame of every step that goes on.
    fn turns(&mut self, shared: &Shared) -> Vec<Turn<'_>> {
        let turns =
            self.members.par_iter_mut().filter_map(|Member { seat, slot, motion, stepping, .. }| {
                let frame = stepping.next_frame(shared)?;
                let is_whole = slot.looks_at_tree(stepping, shared);
                Some(Turn { lane: *seat, world: slot.world_mut()?, command: motion.command(frame), is_whole })
            });
        turns.collect()
    }
}
