//! Laws of a batch's worlds that need more numbers or another kernel than the paper's.

use orchard_batch::Plant;

use crate::layout::{air, damper, fruit, pull, rod, touch};
use crate::schedule::WARPS;
use crate::solver::Solver;

/// Warps of a tile whose fruit hang on stems that bend.
const TEAM_ON_STEMS: usize = 4;

/// Most tiles of a batch beside which workgroups of their own set the air: a card of 132 multiprocessors has room for two of four warps on each.
const TILES_BESIDE_AIR: usize = 132;
/// Most tiles beside which workgroups of their own press the links. With 128, each on a multiprocessor, that took longer than in the last outward pass.
const TILES_BESIDE_PRESS: usize = 64;

/// Laws that hold in every world of a batch. The kernels are specialised by them, so that worlds without them pay nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Laws {
    /// Dampers hold damping ratios: each joint has its own, and the springs lead (`orchard_treephys::TreeBody::lead_springs`).
    pub modal: bool,
    /// Fruit hang on stems that bend.
    pub stems: bool,
    /// A wind blows.
    pub wind: bool,
    /// Joints are solved by conjugate gradients.
    pub conjugate: bool,
    /// Workgroups of the wind's own set the air, on multiprocessors with room beside the tiles. It changes no bit.
    pub air_aside: bool,
    /// Others press the links between frames. It changes no bit.
    pub press_aside: bool,
    /// A robot may touch wood and fruit.
    pub touched: bool,
}

impl Laws {
    /// Number of different sets of laws.
    pub const COUNT: usize = 128;

    /// Laws of a plant.
    pub fn of(plant: &Plant) -> Self {
        Self {
            modal: plant.tree.is_modal,
            stems: plant.spec.fruit.stem.is_some(),
            wind: plant.weather.is_some(),
            conjugate: false,
            air_aside: false,
            press_aside: false,
            touched: false,
        }
    }

    /// These laws under a solver.
    pub fn solved_by(self, solver: Solver) -> Self {
        Self { conjugate: solver == Solver::ConjugateGradients, ..self }
    }

    /// Number of these laws among all.
    pub fn index(self) -> usize {
        usize::from(self.modal)
            + 2 * usize::from(self.stems)
            + 4 * usize::from(self.wind)
            + 8 * usize::from(self.conjugate)
            + 16 * usize::from(self.air_aside)
            + 32 * usize::from(self.press_aside)
            + 64 * usize::from(self.touched)
    }

    /// These laws in a batch of so many tiles.
    pub fn in_tiles(self, tiles: usize) -> Self {
        let blows = self.wind && !self.conjugate && !self.touched;
        Self {
            air_aside: blows && tiles <= TILES_BESIDE_AIR,
            press_aside: blows && tiles <= TILES_BESIDE_PRESS,
            ..self
        }
    }

    /// Constants that specialise the kernels.
    pub fn constants(self) -> Vec<(&'static str, f64)> {
        let all = [
            ("MODAL", self.modal),
            ("STEMS", self.stems),
            ("WIND", self.wind),
            ("AIR_ASIDE", self.air_aside),
            ("PRESS_ASIDE", self.press_aside),
            ("TOUCHES", self.touched),
        ];
        let laws = all.into_iter().filter(|(_, holds)| *holds).map(|(name, _)| (name, 1.0));
        laws.chain([("TEAM", self.team() as f64)]).collect()
    }

    /// Number of warps of a tile. Stems that bend take so many registers that a multiprocessor holds one tile of six warps, or two of four. Conjugate gradients have six:
    /// with four, Mesa's software adapter (22.3) steps a tile of several worlds wrongly, while an H100 gives the bits of worlds alone. The cause is not known.
    pub fn team(self) -> usize {
        if self.stems && !self.conjugate { TEAM_ON_STEMS } else { WARPS }
    }

    /// Number of fields of a row of fruit.
    pub fn fruit_fields(self) -> usize {
        self.pull_field() + if self.wind { pull::FIELDS } else { 0 }
    }

    /// Fields of a row of fruit from which the quads of its motion begin: place, velocity and spin; on stems that bend rotation, rate and rest, the last two with the wear.
    pub fn fruit_motion(self) -> &'static [usize] {
        const MOTION: [usize; 6] = [fruit::P, fruit::V, fruit::ARM, rod::Q, rod::RATE, rod::REST];
        if self.stems { &MOTION } else { &MOTION[..3] }
    }

    /// First field of the pull in a row of fruit.
    pub fn pull_field(self) -> usize {
        if self.stems { rod::FIELDS } else { fruit::FIELDS }
    }

    /// Number of fields of what contacts need of a link.
    pub fn touch_fields(self) -> usize {
        if self.touched { touch::FIELDS } else { 0 }
    }

    /// Number of fields of a row of links' dampers, and of the air.
    pub fn behind_links(self) -> [usize; 2] {
        [if self.modal { damper::FIELDS } else { 0 }, if self.wind { air::FIELDS } else { 0 }]
    }
}
