//! The scaling task: step rate and memory of batches of trees by number of worlds, solver, and differences between the worlds.
//!
//! Only physics is measured, without robot and camera: trees with fruit start with random joint rates (the kick), bend, break and
//! drop fruit. The figures depend on a clock, so `scaling.json` differs from run to run. `docs/scaling.md` describes the
//! measurements.

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
