//! Solvers that advance the worlds of a batch, and their hardware.

use orchard_tasks::plan_file::Backend;
use serde::{Deserialize, Serialize};

/// Solver of a batch's worlds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SolverName {
    /// f32, several worlds per vector register (lanes), by the articulated-body algorithm.
    Lanes,
    /// f64, world by world, by the articulated-body algorithm.
    Aba,
    /// f64, world by world, by conjugate gradients with the articulated-body preconditioner.
    Cg,
    /// f64, world by world, by a sparse Cholesky factor; only in builds with the feature `cholesky`.
    Cholesky,
    /// f32 on a graphics device, by the articulated-body algorithm.
    DeviceAba,
    /// f32 on a graphics device, by conjugate gradients.
    DeviceCg,
}

/// Worlds in f64 at once while lanes are packed: some gigabytes, and enough to fill whole tiles with equal trees.
pub(crate) const WORLDS_AT_ONCE: u32 = 8192;

impl SolverName {
    /// All solvers.
    pub const ALL: [Self; 6] =
        [Self::Lanes, Self::Aba, Self::Cg, Self::Cholesky, Self::DeviceAba, Self::DeviceCg];

    /// Name in files and tables.
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

    /// Returns its backend.
    pub fn backend(self) -> Backend {
        match self {
            Self::Lanes | Self::Aba | Self::Cg | Self::Cholesky => Backend::Cpu,
            Self::DeviceAba | Self::DeviceCg => Backend::Gpu,
        }
    }

    /// Returns the solvers of a backend that this build has.
    pub fn built_for(backend: Backend) -> Vec<Self> {
        Self::ALL.into_iter().filter(|solver| solver.backend() == backend && solver.is_built()).collect()
    }

    /// True if this build has the solver.
    pub fn is_built(self) -> bool {
        self != Self::Cholesky || cfg!(feature = "cholesky")
    }

    /// Returns the condition for a build to have the solver.
    pub fn needs(self) -> &'static str {
        match self {
            Self::Cholesky => "it needs the feature `cholesky`",
            _ => "not implemented",
        }
    }

    /// Returns the largest number of worlds of a batch that are in memory in f64 at once.
    pub(crate) fn at_once(self, worlds: u32) -> u32 {
        if self == Self::Lanes { worlds.min(WORLDS_AT_ONCE) } else { worlds }
    }
}
