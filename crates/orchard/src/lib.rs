//! OrchardBench as a program, and as a library for programs that add their own controllers.
//!
//! [`Program::main`] reads the command line and runs a command: the benchmark, its report and leaderboard, pictures, data sets. A program
//! that adds its own controller ([`Program::with`]) can use it in all of these commands:
//!
//! ```no_run
//! use orchardbench::{Command, Controller, Observation, Program, Record, custom};
//!
//! struct Still(Command, Record);
//!
//! impl Controller for Still {
//!     fn act(&mut self, _: &Observation) -> Command {
//!         self.0
//!     }
//!     fn record(&self) -> &Record {
//!         &self.1
//!     }
//! }
//!
//! fn main() -> std::process::ExitCode {
//!     let still = custom("still", "1", |robot, _| Still(robot.start_command(), Record::default()));
//!     Program::new().with(still).main()
//! }
//! ```
//!
//! Features: `gpu` (batches of trees on a graphics device) and `recording` (MCAP files), both on by default. Running a controller needs
//! neither.

// First, for its macros.
#[macro_use]
#[doc(hidden)]
pub mod output;

mod args;
#[doc(hidden)]
pub mod bare_tree;
mod cli;
mod columns;
#[doc(hidden)]
pub mod commands;
mod failure;
mod headline;
mod interrupt;
mod out_folder;
mod picture_file;
mod program;
#[doc(hidden)]
pub mod rows;
mod signals;

pub use failure::{Failure, Verdict};
pub use program::Program;

pub use orchard_perception::DetectorConfig;
pub use orchard_picker::{AttemptEnd, Controller, ControllerKind, Event, Goal, Record, State, custom};
pub use orchard_robot::{Command, Observation, RobotModel};
pub use orchard_scenario::{Options, Scenario};
