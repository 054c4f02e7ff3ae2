//! The controllers of this crate, by name.

use crate::{
    BaselinePicker, Controller, EXPERT_TOML, ExpertConfig, ExpertPicker, Goal, PAPER_TOML, PickerConfig,
};
use orchard_perception::DetectorConfig;
use orchard_robot::RobotModel;

/// A controller that can be asked for by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kind {
    /// The paper's harvest cycle.
    #[default]
    Baseline,
    /// The best of this crate.
    Expert,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Baseline, Self::Expert];

    /// Its name, as results and command lines give it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Expert => "expert",
        }
    }

    /// Its config as TOML text.
    pub fn toml(self) -> &'static str {
        match self {
            Self::Baseline => PAPER_TOML,
            Self::Expert => EXPERT_TOML,
        }
    }

    /// One at the start of an episode.
    pub fn controller(self, robot: &RobotModel, detector: DetectorConfig) -> Box<dyn Controller> {
        match self {
            Self::Baseline => Box::new(BaselinePicker::new(robot, detector, PickerConfig::paper())),
            Self::Expert => Box::new(ExpertPicker::new(robot, detector, ExpertConfig::preset())),
        }
    }

    /// One at the start of a component task.
    pub fn with_goal(self, goal: &Goal, robot: &RobotModel, detector: DetectorConfig) -> Box<dyn Controller> {
        crate::goal::controller(self, goal, robot, detector)
    }
}
