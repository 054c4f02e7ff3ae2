//! Harvest controllers: observations in, commands out.
//!
//! A [`Controller`] sees an [`orchard_robot::Observation`] a frame and answers with a command. It keeps a
//! [`Record`] of what it believed and did, which a benchmark reads and scores against the truth.
//! [`BaselinePicker`] is the paper's harvest cycle on geometric perception.

mod approach;
mod baseline;
mod blacklist;
mod config;
mod deposit;
mod drive;
mod eyes;
mod grasp;
mod motion;
mod plan;
mod postures;
mod record;
mod robot_state;
mod scan;

pub use baseline::BaselinePicker;
pub use config::{PAPER_TOML, PickerConfig};
pub use record::{AttemptEnd, AttemptId, Event, FailureReason, ImageReport, Record, State};

use orchard_robot::{Command, Observation};

/// A harvest controller.
pub trait Controller {
    /// The command for this control frame.
    fn act(&mut self, observation: &Observation) -> Command;

    /// What it has done so far.
    fn record(&self) -> &Record;
}
