//! Batches of worlds under each solver.

use orchard_batch::{Batch, Isa, ReferenceBatch, Stepper, TreeWorld};
use orchard_gpu::{Gpu, GpuBatch, GpuError, Options};
use orchard_multibody::{Preconditioner, Solver};

use crate::error::ScalingError;
use crate::solver::{SolverName, WORLDS_AT_ONCE};
use crate::trees::Worlds;

/// Makes a batch on a device.
type OnDevice = fn(&Gpu, &[TreeWorld]) -> Result<GpuBatch, GpuError>;

/// The solver of worlds in f64, where it is one and this build has it.
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

/// What makes a batch on a device, where it is a solver of one and this build has it. The only place that a solver of the
/// device is plugged in.
fn on_device(name: SolverName) -> Option<OnDevice> {
    match name {
        SolverName::DeviceAba => Some(GpuBatch::new),
        SolverName::DeviceCg => Some(|gpu, worlds| {
            let solver = orchard_gpu::Solver::ConjugateGradients;
            GpuBatch::with_options(gpu, worlds, Options { solver, ..Options::default() })
        }),
        SolverName::Lanes | SolverName::Aba | SolverName::Cg | SolverName::Cholesky => None,
    }
}

/// A batch of worlds under it. Solvers of a device need one.
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
    match on_device(name).zip(gpu) {
        Some((make, gpu)) => Ok(Box::new(make(gpu, &worlds.all())?)),
        None => Err(ScalingError::NotBuilt(name)),
    }
}
