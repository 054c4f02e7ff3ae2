//! Errors of the scaling task.

use orchard_batch::{BatchError, StepperError};
use orchard_bench::store::StoreError;
use orchard_quantity::ConfigError;
use orchard_spec::randomisation::Mode;

use crate::device::GpuError;
use crate::solver::SolverName;

/// A scaling run that did not end.
#[derive(Debug, thiserror::Error)]
pub enum ScalingError {
    /// The plan has no cell, or more worlds in one than in a later one.
    #[error(
        "no cell to time: modes, worlds (ascending, from 1) and solvers are needed, and at least one repeat of one frame"
    )]
    NoCells,
    /// The protocol does not have the scenario's rules, or a value is out of its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The scenario has a digitised tree.
    #[error("the scaling task grows its trees: it takes no digitised tree")]
    DigitisedTree,
    /// The plan names a solver that this build lacks.
    #[error("this build has no solver {}: {}", .0.name(), .0.needs())]
    NotBuilt(SolverName),
    /// A world cannot be built.
    #[error("a world of mode {mode:?} cannot be built: {reason}")]
    World {
        /// Mode.
        mode: Mode,
        /// Reason.
        reason: String,
    },
    /// Worlds make no batch.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// There is no device that can be used.
    #[error("--backend gpu: {0}; --backend cpu is the default")]
    NoDevice(GpuError),
    /// Worlds make no batch on a device.
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
    /// The stop flag was raised. Figures of one file belong to one run, so nothing is kept.
    #[error("interrupted after {done} of {total} cells of the scaling task, which begins anew")]
    Interrupted {
        /// Cells that were timed.
        done: usize,
        /// Cells planned.
        total: usize,
    },
}
