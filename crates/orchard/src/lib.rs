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

pub use orchard_program::{
    AttemptEnd, Command, Controller, ControllerKind, DetectorConfig, Event, Failure, Goal, Observation,
    Options, PictureRequest, Pictures, Program, Record, RobotModel, Scenario, State, Verdict, custom,
};
