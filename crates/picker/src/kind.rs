//! The controllers of this crate, by name.

use crate::plan::Target;
use crate::task::{AssignedTask, GoalConfig, PushTask};
use crate::{BASELINE_TOML, BaselinePicker, Controller, ExpertConfig, ExpertPicker, Goal, PickerConfig};
use orchard_perception::DetectorConfig;
use orchard_quantity::ConfigError;
use orchard_robot::RobotModel;

/// A controller that can be asked for by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kind {
    /// The reference controller: the paper's harvest cycle, with a second look and a choice of approach by clearance.
    #[default]
    Baseline,
    /// The paper's harvest cycle without our additions.
    Paper,
    /// The best controller of this crate.
    Expert,
}

impl Kind {
    /// All controllers.
    pub const ALL: [Self; 3] = [Self::Baseline, Self::Paper, Self::Expert];

    /// Name of the controller in results and on command lines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Paper => "paper",
            Self::Expert => "expert",
        }
    }

    /// The controller of a name.
    ///
    /// # Errors
    /// There is none of that name; the message lists all names.
    pub fn named(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("no controller '{name}'; the controllers are: {names}")
        })
    }

    /// Everything that determines the controller's config: the TOML text of its base, if it has one, then its own.
    pub fn toml(self) -> &'static str {
        match self {
            Self::Baseline => BASELINE_TOML,
            Self::Paper => concat!(
                include_str!("../configs/baseline/picker.toml"),
                include_str!("../configs/paper/picker.toml")
            ),
            Self::Expert => concat!(
                include_str!("../configs/baseline/picker.toml"),
                include_str!("../configs/expert/picker.toml")
            ),
        }
    }

    /// Makes the controller for a harvest, in its state at the start of an episode.
    pub fn controller(self, robot: &RobotModel, detector: DetectorConfig) -> Box<dyn Controller> {
        match self {
            Self::Baseline | Self::Paper => {
                Box::new(BaselinePicker::new(robot, detector, self.picker_config(robot)))
            }
            Self::Expert => Box::new(ExpertPicker::new(robot, detector, expert_config(robot))),
        }
    }

    /// Makes the controller for a component task, in its state at the start of an episode. Every controller pushes to a point with the
    /// baseline's state machine; `expert` takes the direction with the fewest seen points, slows and yields by the force at the hand, and
    /// tries detours.
    pub fn with_goal(self, goal: &Goal, robot: &RobotModel, detector: DetectorConfig) -> Box<dyn Controller> {
        let goals = GoalConfig::paper();
        let task = match *goal {
            Goal::Grasp { p_odom, radius } => {
                AssignedTask { target: Target { p: p_odom, radius }, push: None }
            }
            Goal::Reach { p_odom, heading_odom } => {
                let compliance = (self == Self::Expert).then_some(goals.compliance);
                let push = PushTask { heading_odom, rules: goals.push, compliance };
                AssignedTask { target: Target { p: p_odom, radius: 0.0 }, push: Some(push) }
            }
        };
        match (self, goal) {
            (Self::Expert, Goal::Grasp { .. }) => {
                Box::new(ExpertPicker::with_task(robot, detector, expert_config(robot), task))
            }
            _ => Box::new(BaselinePicker::with_task(robot, detector, self.picker_config(robot), task)),
        }
    }

    /// Config of the state machine that the baseline, the paper's controller and every push to a point share.
    fn picker_config(self, robot: &RobotModel) -> PickerConfig {
        let config = self.untuned();
        config.tuned(robot).unwrap_or(config)
    }

    fn untuned(self) -> PickerConfig {
        match self {
            Self::Paper => PickerConfig::of_paper_controller(),
            Self::Baseline | Self::Expert => PickerConfig::baseline(),
        }
    }

    /// Checks a robot's figures for the controllers of this crate, which leave out tables that do not pass.
    ///
    /// # Errors
    /// An unknown field, or a value outside its range.
    pub fn check_tuning(robot: &RobotModel) -> Result<(), ConfigError> {
        let tables = ["picker", "expert"];
        if let Some(other) = robot.config().tuning.keys().find(|key| !tables.contains(&key.as_str())) {
            return Err(ConfigError {
                file: format!("robot `{}`", robot.articulation().name),
                field: format!("tuning.{other}"),
                problem: format!("unknown; the tables are {}", tables.join(", ")),
            });
        }
        for kind in Self::ALL {
            kind.untuned().tuned(robot)?;
        }
        ExpertConfig::preset().tuned(robot).map(|_| ())
    }
}

fn expert_config(robot: &RobotModel) -> ExpertConfig {
    let config = ExpertConfig::preset();
    config.tuned(robot).unwrap_or(config)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_controller_has_a_name_and_unknown_names_list_all() {
        for kind in Kind::ALL {
            assert_eq!(Kind::named(kind.name()), Ok(kind));
        }
        let e = Kind::named("lemon").unwrap_err();
        assert_eq!(e, "no controller 'lemon'; the controllers are: baseline, paper, expert");
    }
}
