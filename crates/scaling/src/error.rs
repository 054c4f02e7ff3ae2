//! Errors of the scaling task.

use orchard_batch::{BatchError, StepperError};
use orchard_bench::store::StoreError;
use orchard_quantity::ConfigError;
use orchard_spec::randomisation::Mode;

use crate::device::GpuError;
use crate::solver::SolverName;

/// Reason why a scaling run did not finish.
#[derive(Debug, thiserror::Error)]
pub enum ScalingError {
    /// The plan has no cell, or its numbers of worlds do not ascend.
    #[error(
        "the plan has no cell: it needs modes, numbers of worlds (ascending, >= 1) and solvers, at least 1 repeat and 1 frame"
    )]
    NoCells,
    /// The protocol does not have the scenario's rules, or a value is out of its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The scenario has a digitised tree.
    #[error("the scaling task needs grown trees; a digitised tree cannot be used")]
    DigitisedTree,
    /// The plan names a solver that this build lacks.
    #[error("this build lacks the solver {}: {}", .0.name(), .0.needs())]
    NotBuilt(SolverName),
    /// A world cannot be built.
    #[error("a world of mode {mode:?} cannot be built: {reason}")]
    World {
        /// Mode.
        mode: Mode,
        /// Reason.
        reason: String,
    },
    /// The worlds cannot be put into a batch.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// No usable device.
    #[error("--backend gpu: {0}; --backend cpu is the default")]
    NoDevice(GpuError),
    /// The worlds cannot be put into a batch on the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A batch stopped working.
    #[error(transparent)]
    Stepper(#[from] StepperError),
    /// The threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The result file cannot be written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The stop flag was raised. Nothing is stored, because the figures of a file must be of one run.
    #[error("interrupted after {done} of {total} cells; the scaling task must be run again from the start")]
    Interrupted {
        /// Cells that were timed.
        done: usize,
        /// Cells planned.
        total: usize,
    },
}
