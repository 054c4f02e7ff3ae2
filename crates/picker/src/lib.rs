//! Harvest controllers: observations in, commands out.
//!
//! A [`Controller`] takes an [`orchard_robot::Observation`] each frame and returns a command. It keeps a [`Record`] of its beliefs and actions,
//! which a benchmark scores against the truth. [`BaselinePicker`] runs the paper's harvest cycle on geometric perception: as controller
//! `baseline`, the reference that others must beat, and, with another config, as controller `paper`. [`ExpertPicker`] is the best
//! controller of this crate. [`Kind`] lists all controllers by name.

mod align;
mod baseline;
mod blacklist;
mod choose;
mod cloud;
mod compliance;
mod config;
mod controller_kind;
mod drive;
mod expert;
mod geometry;
mod goal;
mod kind;
mod machine;
mod mobility;
mod motion;
mod perception;
mod picker_core;
mod plan;
mod postures;
mod record;
mod robot_state;
mod row;
mod scan;
mod section;
mod task;
mod trail;
mod walls;
mod watch;
mod wires;
mod wood_memory;

pub use baseline::BaselinePicker;
pub use config::{BASELINE_TOML, PickerConfig};
pub use controller_kind::{ControllerKind, CustomKind, ForeignKind, custom, foreign};
pub use expert::{EXPERT_TOML, ExpertConfig, ExpertPicker};
pub use goal::Goal;
pub use kind::Kind;
pub use record::{Alarm, AttemptEnd, AttemptId, Event, FailureReason, Fault, ImageReport, Record, State};
pub use task::{ComplianceConfig, GOAL_TOML, GoalConfig, PushConfig};

use orchard_robot::{Command, Observation};

/// A harvest controller.
pub trait Controller: Send {
    /// Returns the command for this control frame.
    fn act(&mut self, observation: &Observation) -> Command;

    /// Tells when the run ends, on the clock of the observations \[s\]; called before the first frame, if at all.
    fn run_ends_at(&mut self, time: f64) {
        let _ = time;
    }

    /// Returns the record of the episode so far.
    fn record(&self) -> &Record;
}

impl<C: Controller + ?Sized> Controller for Box<C> {
    fn act(&mut self, observation: &Observation) -> Command {
        (**self).act(observation)
    }

    fn run_ends_at(&mut self, time: f64) {
        (**self).run_ends_at(time);
    }

    fn record(&self) -> &Record {
        (**self).record()
    }
}
