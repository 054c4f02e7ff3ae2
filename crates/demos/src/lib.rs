//! Demonstrations of the tasks by a controller, for policies to learn from.
//!
//! A [`Plan`] says what is demonstrated: scenario, task, observations, actions, seeds. [`run`] computes its episodes in parallel into a
//! folder, whose [`Meta`] states every convention; an interrupted run continues. An episode is a table of steps with the observations that a
//! policy would have seen and the controller's actions in the encoding of `orchard-policy`, PNG images, and the raw commands of every frame.
//! [`DrivenDemos`] makes such an episode of the commands by which a person drove the robot in a viewer.
//!
//! [`verify`] reads all of it back and simulates every episode again.
//!
//! `docs/learning.md` describes the files.

mod config;
mod driven;
mod episode;
mod images;
mod meta;
mod person;
mod plan;
mod record;
mod run;
mod steps;
mod summary;
mod table;
mod take;
mod verify;

pub use config::{DemosRules, V1_TOML};
pub use driven::{Drive, DrivenDemos, DrivenError};
pub use meta::{Meta, MetaError};
pub use person::{PERSON, person};
pub use plan::{DemosError, Plan};
pub use record::{DemoKey, DemoRecord, Split};
#[cfg(feature = "gpu")]
pub use run::run_in_berths;
pub use run::{Demos, DemosResult, run};
pub use summary::DemosSummary;
pub use table::{Column, Table, TableError};
pub use verify::{Verdict, VerifyError, verify};
