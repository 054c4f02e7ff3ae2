//! Component tasks: a controller is told a place and what to do there.

mod config;

pub use config::{ComplianceConfig, GoalConfig, PushConfig};

use crate::baseline::{Errand, Shove};
use crate::plan::Target;
use crate::{BaselinePicker, Controller, PAPER_TOML, PickerConfig};
use orchard_geometry::Vec3;
use orchard_perception::DetectorConfig;
use orchard_robot::RobotModel;

/// The preset `paper` of what component tasks need, as TOML text.
pub const GOAL_TOML: &str = include_str!("../configs/paper/goal.toml");

/// What a component task asks of a controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// Hold the fruit that is said to be here between the fingers.
    Grasp {
        /// Its centre as a perception module would tell it [m, odom].
        p_odom: Vec3,
        /// Its radius, likewise [m].
        radius: f64,
    },
    /// Bring the point between the finger pads here, from a side, and stay.
    Reach {
        /// The place [m, odom].
        p_odom: Vec3,
        /// Level direction from where the base is to stand to the place, from the x axis of odom [rad].
        heading_odom: f64,
    },
}

/// A controller of component tasks that can be asked for by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Performer {
    /// The paper's cycle as far as the task goes; a push goes level and straight on, whatever it meets.
    #[default]
    Baseline,
    /// A push takes the clearest direction that it sees, slows, gives way and goes around by the force at the hand.
    Expert,
}

impl Performer {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Baseline, Self::Expert];

    /// Its name, as results and command lines give it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Expert => "expert",
        }
    }

    /// Its configs as TOML texts, with their names.
    pub fn toml(self) -> [(&'static str, &'static str); 2] {
        [("picker.toml", PAPER_TOML), ("goal.toml", GOAL_TOML)]
    }

    /// One at the start of an episode; `None` if it does not do such a task.
    pub fn controller(
        self,
        goal: &Goal,
        robot: &RobotModel,
        detector: DetectorConfig,
    ) -> Option<Box<dyn Controller>> {
        let goals = GoalConfig::paper();
        let errand = match (self, *goal) {
            (Self::Baseline, Goal::Grasp { p_odom, radius }) => {
                Errand { target: Target { p: p_odom, radius }, push: None }
            }
            (Self::Expert, Goal::Grasp { .. }) => return None,
            (_, Goal::Reach { p_odom, heading_odom }) => {
                let compliance = (self == Self::Expert).then_some(goals.compliance);
                let push = Shove { heading_odom, rules: goals.push, compliance };
                Errand { target: Target { p: p_odom, radius: 0.0 }, push: Some(push) }
            }
        };
        Some(Box::new(BaselinePicker::on_errand(robot, detector, PickerConfig::paper(), errand)))
    }
}
