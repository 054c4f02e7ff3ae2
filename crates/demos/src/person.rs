//! The controller that stands for a person.

use orchard_picker::{Controller, ControllerKind, Record, custom};
use orchard_robot::{Command, Observation};

/// Name of the controller of demonstrations that a person drove.
pub const PERSON: &str = "person";

/// The kind of controller that stands for a person: it keeps still. A stored scenario that names it can be read back by it.
pub fn person() -> impl ControllerKind + 'static {
    const VERSION: &str = "1";
    custom(PERSON, VERSION, |_, _| Still(Record::default()))
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
