//! The scaling task: how fast batches of trees step, by the number of worlds, the solver and what differs between worlds.
//!
//! Physics alone: no robot, no camera. Trees of the nominal condition with their fruit, kicked, which then bend, break and
//! drop fruit as they must. A clock decides the figures, so `scaling.json` is no result that two runs share. `docs/scaling.md`
//! tells how everything is measured.

mod cell;
mod plan;
mod process;
mod results;
mod rules;
mod run;
#[cfg(test)]
mod tests;
mod trees;

pub use plan::{Cell, ScalingPlan, SolverName};
pub use process::{processor_time, resident_bytes};
pub use results::{MemoryBasis, Row, Scaling};
pub use rules::{Effort, PublishedRate, PublishedScaling, ScalingRules};
pub use run::{RESULT, ScalingError, ScalingProgress, run};
