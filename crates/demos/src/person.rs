//! The controller that stands for a person.

use orchard_perception::DetectorConfig;
use orchard_picker::{Controller, ControllerKind, Goal, Record};
use orchard_robot::{Command, Observation, RobotModel};

/// Name of the controller of demonstrations that a person drove.
pub const PERSON: &str = "person";

/// The kind of controller that stands for a person: it keeps still, whatever its goal is. A stored scenario that names it can be read back by it.
pub fn person() -> impl ControllerKind + 'static {
    Person
}

#[derive(Debug)]
struct Person;

impl ControllerKind for Person {
    fn name(&self) -> &str {
        PERSON
    }

    fn configs(&self) -> Vec<(String, String)> {
        vec![("version".to_owned(), "1".to_owned())]
    }

    fn controller(&self, _: &RobotModel, _: &DetectorConfig) -> Box<dyn Controller> {
        Box::new(Still(Record::default()))
    }

    fn takes_goals(&self) -> bool {
        true
    }

    fn with_goal(
        &self,
        _: &Goal,
        robot: &RobotModel,
        detector: &DetectorConfig,
    ) -> Option<Box<dyn Controller>> {
        Some(self.controller(robot, detector))
    }
}

struct Still(Record);

impl Controller for Still {
    fn act(&mut self, observation: &Observation) -> Command {
        Command::still(observation)
    }

    fn record(&self) -> &Record {
        &self.0
    }
}
