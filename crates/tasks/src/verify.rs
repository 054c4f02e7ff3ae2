//! Open-loop verification: measures the damage of a fixed trajectory of joints and base on trees.
//!
//! file -> [`Trajectory`] (checked) -> a run on every tree -> loads, ruptures, fruit -> [`Report`]. `docs/verify.md` describes the
//! file and the report.

mod read;
mod report;
pub(crate) mod rules;
mod run;
#[cfg(test)]
mod tests;
mod trajectory;

pub use report::{METRICS, Report, TrajectoryLine};
pub use rules::VerifyRules;
pub use run::{TreeOutcome, VerifyError, VerifyPlan, record_controller, run};
pub use trajectory::{Row, Trajectory, TrajectoryError, fields};
