//! Environments that advance together, some frames at a time.

use std::time::Instant;

use orchard_policy::Motion;
use orchard_robot::Command;
use orchard_world::{Span, World};
use rayon::prelude::*;

use crate::error::EnvError;
use crate::mover::{Begun, Mover};
use crate::slot::{Shared, Slot, Stepping};

/// An environment in the midst of a step.
pub(crate) struct Member<'a> {
    pub index: usize,
    /// Lane within the crew.
    pub lane: usize,
    pub slot: &'a mut Slot,
    pub motion: Motion,
    pub stepping: Stepping,
    pub shared: &'a Shared,
    /// Commands of the frames that are under way, of which some are judged; none if the step is over.
    pub commands: Vec<Command>,
    pub judged: usize,
    pub is_whole: bool,
}

impl Member<'_> {
    /// Gives it the next frames of its step, if it goes on; returns true if it does.
    fn plan(&mut self) -> bool {
        let (frames, is_whole) = self.slot.frames_ahead(&self.stepping, self.shared);
        let first = self.stepping.next_frame(self.shared).unwrap_or(0);
        self.commands.clear();
        self.commands.extend((first..first + frames).map(|frame| self.motion.command(frame)));
        (self.judged, self.is_whole) = (0, is_whole);
        frames > 0
    }
}

impl Span for &mut Member<'_> {
    fn lane(&self) -> usize {
        self.lane
    }

    fn frames(&mut self) -> (&mut World, &[Command]) {
        let Some(world) = self.slot.world_mut() else { unreachable!("a step has a world") };
        (world, &self.commands[self.judged..])
    }

    fn is_whole(&self) -> bool {
        self.is_whole
    }

    fn after_frame(&mut self) -> bool {
        let command = self.commands[self.judged];
        self.judged += 1;
        self.slot.after_frame(&mut self.stepping, &command, self.shared);
        self.stepping.next_frame(self.shared).is_some()
    }
}

/// Environments whose frames are computed together.
pub(crate) struct Crew<'a> {
    number: usize,
    members: Vec<Member<'a>>,
    shared: &'a Shared,
    /// True if frames were begun and not ended.
    pub is_under_way: bool,
    begun: Option<Begun>,
}

impl<'a> Crew<'a> {
    /// Begins a step of environments, which are given with their index, their lane in the crew, and an action that they can take.
    pub fn new(
        number: usize,
        given: Vec<([usize; 2], &'a mut Slot, &[f32])>,
        shared: &'a Shared,
        mover: &mut Mover,
    ) -> Self {
        let since = Instant::now();
        let members = given.into_par_iter().map(|([index, lane], slot, action)| {
            let Some((motion, stepping)) = slot.motion(action, shared).zip(slot.begin_step(shared)) else {
                unreachable!("an environment that can take an action has a world")
            };
            let (commands, judged, is_whole) = (Vec::new(), 0, false);
            Member { index, lane, slot, motion, stepping, shared, commands, judged, is_whole }
        });
        let members = members.collect();
        mover.note("begin_step", since);
        Self { number, members, shared, is_under_way: false, begun: None }
    }

    /// Begins the next frames of the steps that go on. If there are none, the steps end.
    ///
    /// # Errors
    /// The device was lost.
    pub fn begin(&mut self, mover: &mut Mover) -> Result<(), EnvError> {
        let since = Instant::now();
        self.is_under_way = self.members.par_iter_mut().map(Member::plan).reduce(|| false, |a, b| a | b);
        mover.note("plan", since);
        if self.is_under_way {
            self.begun = mover.begin(self.number, &mut self.spans())?;
            return Ok(());
        }
        self.end_steps(mover)
    }

    /// Ends the frames.
    ///
    /// # Errors
    /// The device was lost.
    pub fn end(&mut self, mover: &mut Mover) -> Result<(), EnvError> {
        if let Some(begun) = self.begun.take() {
            mover.end(self.number, &mut self.spans(), begun)?;
        }
        let is_due = |member: &&mut Member<'_>| member.stepping.are_pictures_due;
        let mut due: Vec<&mut Member<'a>> = self.members.iter_mut().filter(is_due).collect();
        // A step may be over before those of others.
        due.iter_mut().for_each(|member| member.stepping.are_pictures_due = false);
        let due = due.into_iter();
        mover.take_pictures(due.map(|member| (member.index, &mut *member.slot)).collect(), self.shared)?;
        let due = self.members.iter_mut().filter(|member| member.stepping.is_image_due());
        let mut worlds: Vec<_> =
            due.filter_map(|member| Some((member.index, member.slot.world_mut()?))).collect();
        if worlds.is_empty() { Ok(()) } else { mover.observe(&mut worlds).map(|_| ()) }
    }

    /// Ends the steps: what is observed and rewarded.
    fn end_steps(&mut self, mover: &mut Mover) -> Result<(), EnvError> {
        let since = Instant::now();
        let shared = self.shared;
        if shared.ends_with_tree() {
            // Those whose episode ended in the midst of the step.
            let members = self.members.iter_mut();
            mover.catch_up(members.filter_map(|of| Some((of.index, of.slot.world_mut()?))).collect())?;
        }
        self.members.par_iter_mut().for_each(|member| {
            member.slot.end_step(&member.stepping, shared);
            member.slot.keep(&member.motion);
        });
        mover.note("end_step", since);
        Ok(())
    }

    /// Those whose frames are under way.
    fn spans(&mut self) -> Vec<&mut Member<'a>> {
        self.members.iter_mut().filter(|member| !member.commands.is_empty()).collect()
    }
}
