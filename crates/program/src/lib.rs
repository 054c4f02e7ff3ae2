//! The commands of the program `orchard`: options, runs, tables and pictures.
//!
//! Programs with controllers of their own depend on the package `orchardbench`, which offers [`Program`] and what a controller needs.
//! The commands are a crate apart from that entrance because the linker optimises all code at the level of the crate that holds the
//! executable: `orchardbench` at level 3, for the episodes; the commands for size, for a short first build.

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

#[doc(hidden)]
pub use cli::command_line;
pub use failure::{Failure, Verdict};
pub use program::Program;

pub use orchard_perception::DetectorConfig;
pub use orchard_picker::{AttemptEnd, Controller, ControllerKind, Event, Goal, Record, State, custom};
pub use orchard_robot::{Command, Observation, PictureRequest, Pictures, RobotModel};
pub use orchard_scenario::{Options, Scenario};
