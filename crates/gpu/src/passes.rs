//! Passes of a batch of trees: which kernels, how specialised, and how many workgroups of them.

use crate::laws::Laws;
use crate::solver::Solver;

/// Workgroups of a tile, of a warp each, that press the links in wind; a choice between short walks and many workgroups.
const PRESSING_GROUPS: u32 = 80;

/// Kind of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pass {
    /// Advances a frame by elimination.
    Frame,
    /// Advances a frame by conjugate gradients.
    Conjugate,
    /// Applies the events that the tests of a frame have found.
    Events,
    /// Resets marked worlds.
    Reset,
    /// Sets the air of worlds whose wind begins.
    Begin,
    /// Settles marked worlds into their equilibrium.
    Settle,
    /// Measures energies.
    Measure,
    /// Draws marked worlds from the base.
    Vary,
    /// Goes inwards through a substep of worlds with a robot.
    Inward,
    /// Goes outwards through it, after the contacts.
    Outward,
}

impl Pass {
    pub const ALL: [Self; 10] = [
        Self::Frame,
        Self::Conjugate,
        Self::Events,
        Self::Reset,
        Self::Begin,
        Self::Settle,
        Self::Measure,
        Self::Vary,
        Self::Inward,
        Self::Outward,
    ];

    /// Passes of a frame under a solver, in order.
    pub fn of_a_frame(solver: Solver) -> &'static [Self] {
        match solver {
            Solver::Aba => &[Self::Frame, Self::Events],
            Solver::ConjugateGradients => &[Self::Conjugate, Self::Events],
        }
    }

    /// Entry point of its kernel.
    pub fn entry(self) -> &'static str {
        match self {
            Self::Frame | Self::Settle => "frame",
            Self::Conjugate => "conjugate",
            Self::Events => "apply_events",
            Self::Reset => "reset",
            Self::Begin => "begin_wind",
            Self::Measure => "measure",
            Self::Vary => "vary",
            Self::Inward => "substep_inward",
            Self::Outward => "substep_outward",
        }
    }

    /// Constants that specialise its kernel under some laws.
    pub fn constants(self, laws: Laws) -> Vec<(&'static str, f64)> {
        let own: &[_] = match self {
            Self::Conjugate => &[("CONJUGATE", 1.0)],
            Self::Settle => &[("SETTLES", 1.0)],
            _ => &[],
        };
        let moves = matches!(self, Self::Frame | Self::Conjugate | Self::Inward | Self::Outward);
        let blows = laws.wind && moves;
        let blowing: &[_] = if blows { &[("BLOWS", 1.0)] } else { &[] };
        [own, &laws.constants(), blowing].concat()
    }

    /// Workgroups of a tile, with those of the wind's own.
    pub fn groups_of_a_tile(self, laws: Laws) -> u32 {
        match self {
            Self::Frame if laws.air_aside => 2,
            Self::Events if laws.press_aside => 1 + PRESSING_GROUPS,
            _ => 1,
        }
    }
}
