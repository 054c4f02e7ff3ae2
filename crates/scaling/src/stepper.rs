//! Batches of worlds under each solver.

use orchard_batch::{Batch, Isa, ReferenceBatch, Stepper};
use orchard_multibody::{Preconditioner, Solver};

use crate::device::{self, Gpu};
use crate::error::ScalingError;
use crate::solver::{SolverName, WORLDS_AT_ONCE};
use crate::trees::Worlds;

/// The f64 solver, if it is one and this build has it.
fn of_f64(name: SolverName) -> Option<Solver> {
    match name {
        SolverName::Aba => Some(Solver::Aba),
        SolverName::Cg => Some(Solver::Cg { preconditioner: Preconditioner::ArticulatedBody }),
        #[cfg(feature = "cholesky")]
        SolverName::Cholesky => Some(Solver::Cholesky),
        #[cfg(not(feature = "cholesky"))]
        SolverName::Cholesky => None,
        SolverName::Lanes | SolverName::DeviceAba | SolverName::DeviceCg => None,
    }
}

/// A batch of worlds for a solver. Solvers on a device need `gpu`.
pub(crate) fn batch(
    name: SolverName,
    worlds: &Worlds<'_>,
    gpu: Option<&Gpu>,
) -> Result<Box<dyn Stepper>, ScalingError> {
    if name == SolverName::Lanes {
        let starts = (0..worlds.count).step_by(WORLDS_AT_ONCE as usize);
        let chunks = starts.map(|start| worlds.range(start..worlds.count.min(start + WORLDS_AT_ONCE)));
        return Ok(Box::new(Batch::of_chunks(chunks, Isa::best())?));
    }
    if let Some(solver) = of_f64(name) {
        return Ok(Box::new(ReferenceBatch::new(worlds.all(), solver)));
    }
    let batch = gpu.and_then(|gpu| device::batch(name, gpu, &worlds.all()));
    Ok(batch.ok_or(ScalingError::NotBuilt(name))??)
}
