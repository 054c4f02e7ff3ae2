//! The graphics device, in builds with the feature `gpu`; stubs in other builds.

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

    /// Packs worlds into a batch on a device; `None` if the solver does not run on a device.
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

    /// Packs one world to keep a device busy.
    pub fn single(gpu: &Gpu, world: &TreeWorld) -> Result<GpuBatch, StepperError> {
        GpuBatch::new(gpu, std::slice::from_ref(world)).map_err(StepperError::of)
    }

    /// True if the error means that the worlds exceed the memory of the device.
    pub fn is_too_large(e: &GpuError) -> bool {
        matches!(e, GpuError::TooLarge { .. } | GpuError::OutOfMemory { .. })
    }
}

#[cfg(not(feature = "gpu"))]
mod built {
    use orchard_batch::{ReferenceBatch, Stepper, StepperError, TreeWorld};

    use crate::solver::SolverName;

    /// Placeholder of a device.
    pub enum Gpu {}

    /// Placeholder of a device's properties.
    pub struct GpuInfo {
        /// Name.
        pub name: String,
        /// Driver.
        pub driver: String,
        /// Graphics interface.
        pub backend: String,
        /// True for a software adapter.
        pub is_software: bool,
    }

    impl Gpu {
        /// Properties of the device.
        pub fn info(&self) -> &GpuInfo {
            match *self {}
        }
    }

    /// The error of a build without devices.
    #[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
    #[error("this program was built without the feature `gpu`")]
    pub struct GpuError;

    /// Returns an error: this build has no device.
    pub fn open() -> Result<Gpu, GpuError> {
        Err(GpuError)
    }

    /// Returns `None`: this build has no device.
    pub fn batch(_: SolverName, gpu: &Gpu, _: &[TreeWorld]) -> Option<Result<Box<dyn Stepper>, GpuError>> {
        match *gpu {}
    }

    /// Returns `None`: this build has no device.
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
