//! The program: its controllers.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use orchard_picker::ControllerKind;
use orchard_scenario::{OptionValue, Scenario, ScenarioError};

use crate::failure::Failure;
use crate::interrupt;

/// A program with all commands of OrchardBench.
#[derive(Debug, Clone)]
pub struct Program {
    controllers: Vec<Arc<dyn ControllerKind>>,
    stop: Option<Arc<AtomicBool>>,
}

impl Default for Program {
    fn default() -> Self {
        Self::new()
    }
}

impl Program {
    /// A program with the controllers of this project.
    pub fn new() -> Self {
        Self { controllers: orchard_scenario::controllers(), stop: None }
    }

    /// Adds a kind of controller, selected by `--controller NAME`; it replaces one of the same name.
    #[must_use]
    pub fn with(mut self, controller: impl ControllerKind + 'static) -> Self {
        self.controllers.retain(|kind| kind.name() != controller.name());
        self.controllers.push(Arc::new(controller));
        self
    }

    /// Lets a flag stop the benchmark, in place of Ctrl-C and SIGTERM: whoever raises it ends the run with complete files only. A controller
    /// that raises it gives no command in that frame.
    #[must_use]
    pub fn stopped_by(self, stop: Arc<AtomicBool>) -> Self {
        Self { stop: Some(stop), ..self }
    }

    /// The flag that stops the benchmark.
    pub(crate) fn stop(&self) -> Result<&AtomicBool, Failure> {
        match &self.stop {
            Some(flag) => Ok(flag),
            None => Ok(interrupt::listen()?),
        }
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
