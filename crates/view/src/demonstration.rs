//! A demonstration under way: what drives the robot, frame by frame, and the shelf where it is kept.

use orchard_picker::Goal;
use orchard_robot::Command;
use orchard_scenario::Scenario;

/// The command of a frame, and who gave it: [`PERSON`], the name of a controller's state, or nobody.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivenFrame {
    /// The command.
    pub command: Command,
    /// Who gave it.
    pub phase: String,
}

/// Phase of frames that a person drove.
pub const PERSON: &str = "person";

/// The start of a demonstration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Index of the tree: 0, or the first after it in which the task has a target.
    pub index: u32,
    /// The task's goal; none for the harvest.
    pub goal: Option<Goal>,
}

/// Keeps demonstrations of a task, one a seed.
pub trait Shelf {
    /// Checks that one of a seed can be kept, and finds its start.
    ///
    /// # Errors
    /// A sentence that says why none can be kept.
    fn start(&self, scenario: &Scenario, seed: u64) -> Result<Start, String>;

    /// Keeps one, from the start of the world, and returns a sentence about it.
    ///
    /// # Errors
    /// A sentence that says why not.
    fn keep(&mut self, scenario: &Scenario, seed: u64, frames: &[DrivenFrame]) -> Result<String, String>;
}
