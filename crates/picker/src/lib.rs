//! Harvest controllers: observations in, commands out.
//!
//! A [`Controller`] sees an [`orchard_robot::Observation`] a frame and answers with a command. It keeps a
//! [`Record`] of what it believed and did, which a benchmark reads and scores against the truth.

mod record;

pub use record::{AttemptEnd, AttemptId, Event, FailureReason, ImageReport, Record, State};

use orchard_robot::{Command, Observation};

/// A harvest controller.
pub trait Controller {
    /// The command for this control frame.
    fn act(&mut self, observation: &Observation) -> Command;

    /// What it has done so far.
    fn record(&self) -> &Record;
}
