//! Kinds of controllers: what a scenario names and a program makes its controllers by.

use std::fmt::Debug;
use std::sync::Arc;

use orchard_perception::DetectorConfig;
use orchard_robot::{Command, Observation, PictureRequest, RobotModel};

use crate::{BASELINE_TOML, Controller, GOAL_TOML, Goal, Kind, Record};

/// A kind of controller: makes controllers, one an episode.
pub trait ControllerKind: Debug + Send + Sync {
    /// Name, as results and command lines give it.
    fn name(&self) -> &str;

    /// Named texts that the controllers' behaviour depends on besides the project's code, such as config files and a version. They are
    /// hashed into every result.
    fn configs(&self) -> Vec<(String, String)>;

    /// Files that the controllers are made of, by name. Results store them, so that the controllers can be made again; [`Self::configs`] must
    /// decide them, by their hash for example.
    fn files(&self) -> Vec<(&str, &[u8])> {
        Vec::new()
    }

    /// Notes for the user who chose this kind, a sentence each.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// Colour pictures that the controllers ask for; none if they look at the depth camera alone.
    fn pictures(&self) -> Option<Arc<PictureRequest>> {
        None
    }

    /// Makes a controller at the start of an episode.
    fn controller(&self, robot: &RobotModel, detector: &DetectorConfig) -> Box<dyn Controller>;

    /// True if controllers of this kind can be given a goal, as the component tasks do.
    fn takes_goals(&self) -> bool {
        false
    }

    /// True if controllers of this kind can do nothing without a goal.
    fn needs_goal(&self) -> bool {
        false
    }

    /// Makes a controller at the start of a trial of a component task; `None` if this kind takes no goals.
    fn with_goal(
        &self,
        goal: &Goal,
        robot: &RobotModel,
        detector: &DetectorConfig,
    ) -> Option<Box<dyn Controller>> {
        let _ = (goal, robot, detector);
        None
    }
}

/// A kind made of a function: for controllers from outside this project.
#[derive(Clone)]
pub struct CustomKind<F> {
    name: String,
    version: String,
    make: F,
}

/// Makes a kind of controller from its name, the version of its code, and a function that makes one for a robot and a detector. The version
/// is hashed into every result: raise it whenever the controller changes, so that no result of older code is taken for a new one.
pub fn custom<C, F>(name: &str, version: &str, make: F) -> CustomKind<F>
where
    C: Controller + 'static,
    F: Fn(&RobotModel, &DetectorConfig) -> C + Send + Sync,
{
    CustomKind { name: name.to_owned(), version: version.to_owned(), make }
}

impl<F> Debug for CustomKind<F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.name, self.version)
    }
}

impl<C, F> ControllerKind for CustomKind<F>
where
    C: Controller + 'static,
    F: Fn(&RobotModel, &DetectorConfig) -> C + Send + Sync,
{
    fn name(&self) -> &str {
        &self.name
    }

    fn configs(&self) -> Vec<(String, String)> {
        vec![("version".to_owned(), self.version.clone())]
    }

    fn controller(&self, robot: &RobotModel, detector: &DetectorConfig) -> Box<dyn Controller> {
        Box::new((self.make)(robot, detector))
    }
}

/// A kind of controller that this program does not have: its name and config texts, as a result gives them. Its controllers keep still.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ForeignKind {
    name: String,
    configs: Vec<(String, String)>,
}

/// Names a kind of controller that this program does not have, with the config texts that its results are hashed with.
pub fn foreign(name: &str, configs: Vec<(String, String)>) -> ForeignKind {
    ForeignKind { name: name.to_owned(), configs }
}

impl ControllerKind for ForeignKind {
    fn name(&self) -> &str {
        &self.name
    }

    fn configs(&self) -> Vec<(String, String)> {
        self.configs.clone()
    }

    fn controller(&self, _: &RobotModel, _: &DetectorConfig) -> Box<dyn Controller> {
        Box::new(KeepsStill::default())
    }
}

/// A controller that commands no motion.
#[derive(Debug, Default)]
struct KeepsStill {
    record: Record,
}

impl Controller for KeepsStill {
    fn act(&mut self, observation: &Observation) -> Command {
        Command::still(observation)
    }

    fn record(&self) -> &Record {
        &self.record
    }
}

impl ControllerKind for Kind {
    fn name(&self) -> &str {
        (*self).name()
    }

    fn configs(&self) -> Vec<(String, String)> {
        let own = match self {
            Kind::Baseline => None,
            Kind::Paper => Some(("paper/picker.toml", crate::config::PAPER_TOML)),
            Kind::Expert => Some(("expert/picker.toml", crate::EXPERT_TOML)),
        };
        // The others are based on the baseline's config, and the push of the component tasks is the baseline's under every name.
        let shared = [("picker.toml", BASELINE_TOML), ("goal.toml", GOAL_TOML)];
        shared.into_iter().chain(own).map(|(name, text)| (name.to_owned(), text.to_owned())).collect()
    }

    fn controller(&self, robot: &RobotModel, detector: &DetectorConfig) -> Box<dyn Controller> {
        (*self).controller(robot, detector.clone())
    }

    fn takes_goals(&self) -> bool {
        true
    }

    fn with_goal(
        &self,
        goal: &Goal,
        robot: &RobotModel,
        detector: &DetectorConfig,
    ) -> Option<Box<dyn Controller>> {
        Some((*self).with_goal(goal, robot, detector.clone()))
    }
}
