//! The program: its controllers.

use std::sync::Arc;

use orchard_picker::ControllerKind;
use orchard_scenario::{OptionValue, Scenario, ScenarioError};

/// A program with all commands of OrchardBench.
#[derive(Debug, Clone)]
pub struct Program {
    controllers: Vec<Arc<dyn ControllerKind>>,
}

impl Default for Program {
    fn default() -> Self {
        Self::new()
    }
}

impl Program {
    /// A program with the controllers of this project.
    pub fn new() -> Self {
        Self { controllers: orchard_scenario::controllers() }
    }

    /// Adds a kind of controller, selected by `--controller NAME`; it replaces one of the same name.
    #[must_use]
    pub fn with(mut self, controller: impl ControllerKind + 'static) -> Self {
        self.controllers.retain(|kind| kind.name() != controller.name());
        self.controllers.push(Arc::new(controller));
        self
    }

    /// The kinds of controllers.
    pub fn controllers(&self) -> &[Arc<dyn ControllerKind>] {
        &self.controllers
    }

    /// A scenario under the controller of a name.
    pub(crate) fn under(&self, scenario: &Scenario, controller: &str) -> Result<Scenario, ScenarioError> {
        scenario.under(&OptionValue::new(controller, "controller"), &self.controllers)
    }
}
