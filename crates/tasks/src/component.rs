//! Component tasks: each tests one skill on given targets.
//!
//! `reach-and-grasp`: hold a named fruit. `gentle`: push the hand to a point behind the canopy. trees -> targets (seeded) -> trials
//! (world and controller, frame by frame) -> records -> metrics -> summary. `docs/benchmark-v1.md` defines the figures.

mod gentle;
mod grasp;
mod metrics;
mod plan;
mod record;
pub(crate) mod rules;
mod run;
mod summary;
mod task;
#[cfg(test)]
mod tests;
mod trial;

pub use gentle::{Gentle, PointTarget};
pub use grasp::{FruitTarget, ReachAndGrasp};
pub use metrics::metrics;
pub use plan::{ComponentKey, ComponentPlan, ComponentRun};
pub use record::{TreeRecord, TrialOutcome, TrialRecord};
pub use rules::{ComponentRules, GentleRules, GraspRules};
pub use run::{ComponentResult, Trials, run};
pub use summary::{ComponentSummary, TreeLine};
pub use task::Component;
pub use trial::TrialWatch;
