//! Steps that a controller of the benchmark takes instead of a policy.

use orchard_picker::{Controller, Goal};
use orchard_robot::Command;
use orchard_tasks::component::{Component, Gentle, ReachAndGrasp};
use orchard_world::World;

use super::{Shared, Slot, State};
use crate::alone::Alone;
use crate::driven::{Driven, Via};

impl Slot {
    /// The world, for truth and scoring; none before the first reset.
    pub fn truth(&self) -> Option<&World> {
        self.running.as_ref().map(|(world, _)| &**world)
    }

    /// The task's goal of this episode; none for a task without one.
    pub fn goal(&self) -> Option<Goal> {
        match &self.running.as_ref()?.1.task {
            State::Harvest(_) => None,
            State::Reach(trial) => Some(ReachAndGrasp::goal(trial.target())),
            State::Gentle(trial) => Some(Gentle::goal(trial.target())),
        }
    }

    /// Takes a step under a controller; one that [`Slot::goes_on`] allows.
    pub fn drive(
        &mut self,
        controller: &mut dyn Controller,
        via: Via,
        alone: &Alone,
        shared: &Shared,
    ) -> Driven {
        let encoding = &shared.encoding;
        let last = self.running.as_ref().map_or(encoding.start(), |(_, episode)| episode.set);
        let (mut wanted, mut commands): (Vec<Command>, Vec<Command>) = (Vec::new(), Vec::new());
        let mut motion = None;
        self.advance(alone, shared, |frame, world| {
            // The world's latest image stays what a policy would have seen.
            let command = controller.act(&world.peek());
            wanted.push(command);
            let told = match via {
                Via::Commands => command,
                Via::Actions => motion
                    .get_or_insert_with(|| encoding.motion(&encoding.action(&[command], &last), &last))
                    .command(frame),
            };
            commands.push(told);
            told
        });
        // A policy acts on what it sees at the start of a step; a controller's commands are encoded when all are known.
        let known = match via {
            Via::Commands => &wanted[..],
            Via::Actions => &wanted[..1],
        };
        let action = encoding.action(known, &last);
        let motion = encoding.motion(&action, &last);
        if let (Via::Actions, Some((_, episode))) = (via, &mut self.running) {
            // As after the same action of a policy, whose last command is there but for rounding.
            episode.set = motion.end();
        }
        Driven { error: encoding.error(&motion, &wanted), action, commands }
    }
}
