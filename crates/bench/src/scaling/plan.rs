//! What a scaling run consists of.

use orchard_multibody::{Preconditioner, Solver};
use orchard_spec::randomisation::Mode;
use serde::{Deserialize, Serialize};

use super::rules::{Effort, ScalingRules};
use crate::protocol::Protocol;

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
}

impl SolverName {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Lanes, Self::Aba, Self::Cg, Self::Cholesky];

    /// Its name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lanes => "lanes",
            Self::Aba => "aba",
            Self::Cg => "cg",
            Self::Cholesky => "cholesky",
        }
    }

    /// Whether this build has it.
    pub fn is_built(self) -> bool {
        self == Self::Lanes || self.of_f64().is_some()
    }

    /// The solver of worlds in f64, where it is one and this build has it.
    pub(super) fn of_f64(self) -> Option<Solver> {
        match self {
            Self::Lanes => None,
            Self::Aba => Some(Solver::Aba),
            Self::Cg => Some(Solver::Cg { preconditioner: Preconditioner::ArticulatedBody }),
            #[cfg(feature = "cholesky")]
            Self::Cholesky => Some(Solver::Cholesky),
            #[cfg(not(feature = "cholesky"))]
            Self::Cholesky => None,
        }
    }
}

/// One batch that is timed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    /// What differs between its worlds.
    pub mode: Mode,
    /// Its worlds: the first so many of the mode.
    pub worlds: u32,
    /// How they are advanced.
    pub solver: SolverName,
}

/// A scaling run: every mode x number of worlds x solver.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalingPlan {
    /// Profile.
    pub profile: String,
    /// Seed of all trees and kicks.
    pub seed: u64,
    /// What differs between the worlds of a batch, in order.
    pub modes: Vec<Mode>,
    /// Numbers of worlds, ascending.
    pub worlds: Vec<u32>,
    /// Solvers, in order.
    pub solvers: Vec<SolverName>,
    /// Frames of a course.
    pub frames: u32,
    /// Largest joint rate of a kick [rad/s].
    pub kick: f64,
    /// Times that a cell is measured.
    pub repeats: u32,
    /// Time for all of them [s].
    pub cell_time: f64,
    /// Version of protocol and configs.
    pub config_version: String,
}

impl ScalingPlan {
    /// The protocol's plan, with every solver of this build, on the first tuning seed.
    pub fn of_protocol(protocol: &Protocol, profile: &str, effort: &Effort) -> Self {
        let rules: &ScalingRules = &protocol.scaling;
        Self {
            profile: profile.to_owned(),
            seed: protocol.tuning_seeds.first().copied().unwrap_or_default(),
            modes: Mode::ALL.to_vec(),
            worlds: effort.worlds(),
            solvers: SolverName::ALL.into_iter().filter(|solver| solver.is_built()).collect(),
            frames: rules.frames.get(),
            kick: rules.kick.si(),
            repeats: effort.repeats.get(),
            cell_time: effort.cell_time.si(),
            config_version: protocol.version.clone(),
        }
    }

    /// All cells, mode by mode, from few worlds to many, solver by solver.
    pub fn cells(&self) -> Vec<Cell> {
        self.modes.iter().flat_map(|&mode| self.cells_of(mode)).collect()
    }

    /// Those of a mode.
    pub(super) fn cells_of(&self, mode: Mode) -> Vec<Cell> {
        let of = |&worlds: &u32| self.solvers.iter().map(move |&solver| Cell { mode, worlds, solver });
        self.worlds.iter().flat_map(of).collect()
    }
}
