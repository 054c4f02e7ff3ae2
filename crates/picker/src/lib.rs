//! Harvest controllers: observations in, commands out.
//!
//! A [`Controller`] sees an [`orchard_robot::Observation`] a frame and answers with a command. It keeps a
//! [`Record`] of what it believed and did, which a benchmark reads and scores against the truth.
//! [`BaselinePicker`] is the paper's harvest cycle on geometric perception, the reference that others must beat; [`ExpertPicker`] is the best that this crate has;
//! [`Kind`] names the controllers of this crate.

mod align;
mod baseline;
mod blacklist;
mod choose;
mod compliance;
mod config;
mod controller_kind;
mod drive;
mod errand;
mod expert;
mod eyes;
mod goal;
mod kind;
mod machine;
mod motion;
mod plan;
mod postures;
mod record;
mod rig;
mod robot_state;
mod scan;

pub use baseline::BaselinePicker;
pub use config::{PAPER_TOML, PickerConfig};
pub use controller_kind::{ControllerKind, CustomKind, custom};
pub use expert::{EXPERT_TOML, ExpertConfig, ExpertPicker};
pub use goal::{ComplianceConfig, GOAL_TOML, Goal, GoalConfig, PushConfig};
pub use kind::Kind;
pub use record::{AttemptEnd, AttemptId, Event, FailureReason, ImageReport, Record, State};

use orchard_robot::{Command, Observation};

/// A harvest controller.
pub trait Controller: Send {
    /// The command for this control frame.
    fn act(&mut self, observation: &Observation) -> Command;

    /// What it has done so far.
    fn record(&self) -> &Record;
}

impl<C: Controller + ?Sized> Controller for Box<C> {
    fn act(&mut self, observation: &Observation) -> Command {
        (**self).act(observation)
    }

    fn record(&self) -> &Record {
        (**self).record()
    }
}
