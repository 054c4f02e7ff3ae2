//! The scaling task: how fast batches of trees step, by the number of worlds, the solver and what differs between worlds.
//!
//! Physics alone: no robot, no camera. Trees of the nominal condition with their fruit, kicked, which then bend, break and
//! drop fruit. The figures depend on a clock, so `scaling.json` differs from run to run. `docs/scaling.md`
//! describes the measurements.

mod axes;
mod cell;
mod device;
mod error;
mod plan;
mod process;
mod results;
mod rules;
mod run;
mod solver;
mod stepper;
#[cfg(test)]
mod tests;
mod trees;

pub use axes::{AxisKind, AxisRow};
pub use cell::wake;
pub use device::{Gpu, GpuError};
pub use error::ScalingError;
pub use plan::{AxesPlan, Cell, ContinuousTiming, Limits, ScalingPlan};
pub use process::{processor_time, resident_bytes};
pub use results::{Adapter, MemoryBasis, Omitted, Row, Scaling};
pub use rules::{
    AxesRules, DeviceRules, Effort, PublishedBuild, PublishedRate, PublishedScaling, PublishedSolver,
    ScalingRules, StudyRules,
};
pub use run::{RESULT, ScalingProgress, measure, run};
pub use solver::SolverName;
