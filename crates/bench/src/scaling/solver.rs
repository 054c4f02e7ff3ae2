//! How the worlds of a batch are advanced, and on what.

use orchard_batch::{Batch, Isa, ReferenceBatch, Stepper, TreeWorld};
use orchard_gpu::{Gpu, GpuBatch, GpuError, Options};
use orchard_multibody::{Preconditioner, Solver};
use serde::{Deserialize, Serialize};

use super::run::ScalingError;
use super::trees::Worlds;

/// What advances the batches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// The processor.
    #[default]
    Cpu,
    /// A graphics device.
    Gpu,
}

impl Backend {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Cpu, Self::Gpu];

    /// Its name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
        }
    }
}

impl std::str::FromStr for Backend {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.map(Self::name).join(" and ");
        let found = Self::ALL.into_iter().find(|backend| backend.name() == text);
        found.ok_or_else(|| format!("there are {known}"))
    }
}

/// How the worlds of a batch are advanced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SolverName {
    /// f32, some worlds in the lanes of each vector, by the articulated-body algorithm.
    Lanes,
    /// f64, world by world, by the articulated-body algorithm.
    Aba,
    /// f64, world by world, by conjugate gradients under the articulated-body preconditioner.
    Cg,
    /// f64, world by world, by a sparse Cholesky factor; only in builds with the feature `cholesky`.
    Cholesky,
    /// f32 on a graphics device, by the articulated-body algorithm.
    DeviceAba,
    /// f32 on a graphics device, by conjugate gradients.
    DeviceCg,
}

/// Worlds that are in f64 at once while lanes are packed: some gigabytes, and enough that those of one kind fill whole tiles.
const WORLDS_AT_ONCE: u32 = 8192;

/// Makes a batch on a device.
type OnDevice = fn(&Gpu, &[TreeWorld]) -> Result<GpuBatch, GpuError>;

impl SolverName {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Lanes, Self::Aba, Self::Cg, Self::Cholesky, Self::DeviceAba, Self::DeviceCg];

    /// Its name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lanes => "lanes",
            Self::Aba => "aba",
            Self::Cg => "cg",
            Self::Cholesky => "cholesky",
            Self::DeviceAba => "device-aba",
            Self::DeviceCg => "device-cg",
        }
    }

    /// Where it runs.
    pub fn backend(self) -> Backend {
        match self {
            Self::Lanes | Self::Aba | Self::Cg | Self::Cholesky => Backend::Cpu,
            Self::DeviceAba | Self::DeviceCg => Backend::Gpu,
        }
    }

    /// Those of a backend that this build has.
    pub fn built_for(backend: Backend) -> Vec<Self> {
        Self::ALL.into_iter().filter(|solver| solver.backend() == backend && solver.is_built()).collect()
    }

    /// Whether this build has it.
    pub fn is_built(self) -> bool {
        self == Self::Lanes || self.of_f64().is_some() || self.on_device().is_some()
    }

    /// What it takes to have it.
    pub fn needs(self) -> &'static str {
        match self {
            Self::Cholesky => "it needs the feature `cholesky`",
            _ => "it is not there yet",
        }
    }

    /// The solver of worlds in f64, where it is one and this build has it.
    fn of_f64(self) -> Option<Solver> {
        match self {
            Self::Aba => Some(Solver::Aba),
            Self::Cg => Some(Solver::Cg { preconditioner: Preconditioner::ArticulatedBody }),
            #[cfg(feature = "cholesky")]
            Self::Cholesky => Some(Solver::Cholesky),
            #[cfg(not(feature = "cholesky"))]
            Self::Cholesky => None,
            Self::Lanes | Self::DeviceAba | Self::DeviceCg => None,
        }
    }

    /// What makes a batch on a device, where it is a solver of one and this build has it. The only place that a solver of the
    /// device is plugged in.
    fn on_device(self) -> Option<OnDevice> {
        match self {
            Self::DeviceAba => Some(GpuBatch::new),
            Self::DeviceCg => Some(|gpu, worlds| {
                let solver = orchard_gpu::Solver::ConjugateGradients;
                GpuBatch::with_options(gpu, worlds, Options { solver, ..Options::default() })
            }),
            Self::Lanes | Self::Aba | Self::Cg | Self::Cholesky => None,
        }
    }

    /// How many of a batch's worlds are in memory in f64 at once, at most.
    pub(super) fn at_once(self, worlds: u32) -> u32 {
        if self == Self::Lanes { worlds.min(WORLDS_AT_ONCE) } else { worlds }
    }

    /// A batch of worlds under it. Solvers of a device need one.
    pub(super) fn batch(
        self,
        worlds: &Worlds<'_>,
        gpu: Option<&Gpu>,
    ) -> Result<Box<dyn Stepper>, ScalingError> {
        if self == Self::Lanes {
            let starts = (0..worlds.count).step_by(WORLDS_AT_ONCE as usize);
            let chunks = starts.map(|start| worlds.range(start..worlds.count.min(start + WORLDS_AT_ONCE)));
            return Ok(Box::new(Batch::of_chunks(chunks, Isa::best())?));
        }
        if let Some(solver) = self.of_f64() {
            return Ok(Box::new(ReferenceBatch::new(worlds.all(), solver)));
        }
        match self.on_device().zip(gpu) {
            Some((make, gpu)) => Ok(Box::new(make(gpu, &worlds.all())?)),
            None => Err(ScalingError::NotBuilt(self)),
        }
    }
}
