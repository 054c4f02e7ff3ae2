//! A learned controller under way.

use std::sync::Arc;

use orchard_network::Tensor;
use orchard_picker::{Controller, Event, Fault, Record};
use orchard_policy::{Pilot, Values};
use orchard_robot::{Command, Observation};

use crate::policy::Policy;

/// Asks the network for actions and carries them out. It declares no attempts. From its first fault on it holds the robot still.
pub(crate) struct LearnedController {
    policy: Arc<Policy>,
    pilot: Pilot,
    states: Vec<Tensor>,
    /// Actions that are still to be carried out, number by number, and the place of the next.
    actions: Vec<f32>,
    next: usize,
    /// True if the policy needs a target and has none.
    lost: bool,
    failed: bool,
    record: Record,
}

impl LearnedController {
    /// Begins an episode; the target is told as in `orchard_policy::Reading::target`.
    pub fn new(policy: Arc<Policy>, target: Option<[f64; 4]>) -> Self {
        let lost = policy.spec.spaces.target.is_some() && target.is_none();
        Self {
            pilot: Pilot::new(policy.encoding.clone(), target),
            states: policy.wiring.start(),
            policy,
            actions: Vec::new(),
            next: 0,
            lost,
            failed: false,
            record: Record::default(),
        }
    }

    /// The next action, one number a channel.
    fn action(&mut self, seen: &[Values]) -> Result<Vec<f32>, Fault> {
        let Policy { network, wiring, encoding, spec } = &*self.policy;
        if self.lost {
            return Err(Fault::NoTarget);
        }
        let size = encoding.interface().action.len();
        if self.next >= self.actions.len() {
            self.actions = wiring.run(network, seen, &mut self.states).map_err(|_| Fault::NoAction)?;
            self.actions.truncate(spec.execute.map_or(usize::MAX, |n| (n as usize).saturating_mul(size)));
            self.next = 0;
        }
        let action = self.actions.get(self.next..self.next + size).ok_or(Fault::NoAction)?;
        self.next += size;
        match encoding.refused(action) {
            Some(_) => Err(Fault::ActionNotFinite),
            None => Ok(action.to_vec()),
        }
    }
}

impl Controller for LearnedController {
    fn act(&mut self, sensed: &Observation) -> Command {
        if self.failed {
            return self.pilot.hold(sensed);
        }
        let Some(seen) = self.pilot.see(sensed) else { return self.pilot.command(sensed) };
        match self.action(&seen) {
            Ok(action) => {
                self.pilot.act(&action);
                self.pilot.command(sensed)
            }
            Err(fault) => {
                self.failed = true;
                self.record.events.push(Event::GaveUp { time: sensed.time, fault });
                self.pilot.hold(sensed)
            }
        }
    }

    fn record(&self) -> &Record {
        &self.record
    }
}
