//! A controller that plays back recorded commands, and compares them with those that the real controller computes.

use std::cell::RefCell;
use std::rc::Rc;

use orchard_robot::{Command, Observation};
use orchard_tasks::harvest::interface::{BenchController, ControllerEvent};

use crate::clock::nanoseconds;
use crate::command::CommandMessage;
use crate::sink::json;

use super::comparison::{Comparison, Differs};

/// Returns the recorded commands. The events are the controller's own.
pub struct Playback<C> {
    controller: C,
    comparison: Rc<RefCell<Comparison>>,
}

impl<C: BenchController> Playback<C> {
    pub fn new(controller: C, comparison: Rc<RefCell<Comparison>>) -> Self {
        Self { controller, comparison }
    }
}

impl<C: BenchController> BenchController for Playback<C> {
    fn act(&mut self, observation: &Observation) -> Command {
        let own = self.controller.act(observation);
        let mut comparison = self.comparison.borrow_mut();
        // Without a recorded command the world runs on the controller's, and the sink counts a surplus command.
        let Some(bytes) = comparison.command(nanoseconds(observation.time)) else { return own };
        if bytes == json(&CommandMessage::from(&own)) {
            return own;
        }
        let message = serde_json::from_slice::<CommandMessage>(bytes).ok();
        let recorded = message.and_then(|message| Command::try_from(&message).ok());
        match recorded {
            Some(recorded) => {
                comparison.other_command(Differs::OtherCommand);
                recorded
            }
            None => {
                comparison.other_command(Differs::NoCommand);
                own
            }
        }
    }

    fn run_ends_at(&mut self, time: f64) {
        self.controller.run_ends_at(time);
    }

    fn drain_log(&mut self) -> Vec<ControllerEvent> {
        self.controller.drain_log()
    }
}
