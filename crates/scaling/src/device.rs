//! The graphics device, in builds that have one (feature `gpu`). The only place where a solver of the device is plugged in.

#[cfg(feature = "gpu")]
mod built {
    use orchard_batch::{Stepper, StepperError, TreeWorld};
    use orchard_gpu::{Choice, GpuBatch, Options, Solver};
    pub use orchard_gpu::{Gpu, GpuError};

    use crate::solver::SolverName;

    /// Opens any device.
    pub fn open() -> Result<Gpu, GpuError> {
        Gpu::open(Choice::Any)
    }

    /// Packs worlds into a batch on a device; `None` if the solver is none of a device.
    pub fn batch(
        name: SolverName,
        gpu: &Gpu,
        worlds: &[TreeWorld],
    ) -> Option<Result<Box<dyn Stepper>, GpuError>> {
        let solver = match name {
            SolverName::DeviceAba => Options::default().solver,
            SolverName::DeviceCg => Solver::ConjugateGradients,
            SolverName::Lanes | SolverName::Aba | SolverName::Cg | SolverName::Cholesky => return None,
        };
        let batch = GpuBatch::with_options(gpu, worlds, Options { solver, ..Options::default() });
        Some(batch.map(|batch| Box::new(batch) as Box<dyn Stepper>))
    }

    /// Packs one world, for a device that is kept busy.
    pub fn single(gpu: &Gpu, world: &TreeWorld) -> Result<GpuBatch, StepperError> {
        GpuBatch::new(gpu, std::slice::from_ref(world)).map_err(StepperError::of)
    }

    /// True if the worlds are more than the device has memory for.
    pub fn is_too_large(e: &GpuError) -> bool {
        matches!(e, GpuError::TooLarge { .. } | GpuError::OutOfMemory { .. })
    }
}

#[cfg(not(feature = "gpu"))]
mod built {
    use orchard_batch::{ReferenceBatch, Stepper, StepperError, TreeWorld};

    use crate::solver::SolverName;

    /// A device, of which this build has none.
    pub enum Gpu {}

    /// Facts of a device, of which this build has none.
    pub struct GpuInfo {
        /// Name.
        pub name: String,
        /// Driver.
        pub driver: String,
        /// Graphics interface.
        pub backend: String,
        /// True if the processor does its work.
        pub is_software: bool,
    }

    impl Gpu {
        /// Facts of the device.
        pub fn info(&self) -> &GpuInfo {
            match *self {}
        }
    }

    /// The error of a build without devices.
    #[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
    #[error("this program was built without the feature `gpu`")]
    pub struct GpuError;

    /// Opens no device.
    pub fn open() -> Result<Gpu, GpuError> {
        Err(GpuError)
    }

    /// Packs nothing: there is no device.
    pub fn batch(_: SolverName, gpu: &Gpu, _: &[TreeWorld]) -> Option<Result<Box<dyn Stepper>, GpuError>> {
        match *gpu {}
    }

    /// Packs nothing: there is no device.
    pub fn single(gpu: &Gpu, _: &TreeWorld) -> Result<ReferenceBatch, StepperError> {
        match *gpu {}
    }

    /// False: there is no device.
    pub fn is_too_large(_: &GpuError) -> bool {
        false
    }
}

#[cfg(not(feature = "gpu"))]
pub use built::GpuInfo;
pub use built::{Gpu, GpuError};
pub(crate) use built::{batch, is_too_large, open, single};
#[cfg(feature = "gpu")]
pub use orchard_gpu::GpuInfo;
