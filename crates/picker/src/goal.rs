//! Component tasks: a controller is told a place and what to do there.

mod config;

pub use config::{ComplianceConfig, GoalConfig, PushConfig};

use crate::errand::{Errand, Shove};
use crate::plan::Target;
use crate::{BaselinePicker, Controller, ExpertConfig, ExpertPicker, Kind, PickerConfig};
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

/// Makes the controller of a component task. A place is pushed to by the baseline's machine under either name: `expert` takes the
/// clearest direction that it sees, slows, gives way and goes around by the force at the hand.
pub(crate) fn controller(
    kind: Kind,
    goal: &Goal,
    robot: &RobotModel,
    detector: DetectorConfig,
) -> Box<dyn Controller> {
    let goals = GoalConfig::paper();
    match (kind, *goal) {
        (Kind::Expert, Goal::Grasp { p_odom, radius }) => {
            let errand = Errand { target: Target { p: p_odom, radius }, push: None };
            Box::new(ExpertPicker::on_errand(robot, detector, ExpertConfig::preset(), errand))
        }
        (Kind::Baseline, Goal::Grasp { p_odom, radius }) => {
            let errand = Errand { target: Target { p: p_odom, radius }, push: None };
            Box::new(BaselinePicker::on_errand(robot, detector, PickerConfig::paper(), errand))
        }
        (_, Goal::Reach { p_odom, heading_odom }) => {
            let compliance = (kind == Kind::Expert).then_some(goals.compliance);
            let push = Shove { heading_odom, rules: goals.push, compliance };
            let errand = Errand { target: Target { p: p_odom, radius: 0.0 }, push: Some(push) };
            Box::new(BaselinePicker::on_errand(robot, detector, PickerConfig::paper(), errand))
        }
    }
}
