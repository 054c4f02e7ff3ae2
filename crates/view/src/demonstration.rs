//! A demonstration under way: what drives the robot, frame by frame, and the shelf where it is kept.

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

/// Keeps demonstrations of the first tree of seeds.
pub trait Shelf {
    /// Checks that one of a seed can be kept.
    ///
    /// # Errors
    /// A sentence that says why not.
    fn check(&self, scenario: &Scenario, seed: u64) -> Result<(), String>;

    /// Keeps one, from the start of the world, and returns a sentence about it.
    ///
    /// # Errors
    /// A sentence that says why not.
    fn keep(&mut self, scenario: &Scenario, seed: u64, frames: &[DrivenFrame]) -> Result<String, String>;
}
