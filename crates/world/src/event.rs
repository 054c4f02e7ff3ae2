//! What happens in a world, told with the frame in which it did.

use orchard_fruit::{FruitEvent, Impact, Partner};
use serde::{Deserialize, Serialize};

/// Something a benchmark counts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum WorldEvent {
    /// Both fingers press on a fruit for the first time since both last let go.
    FruitGripped {
        /// Fruit index.
        fruit: usize,
        /// Frame.
        frame: u32,
    },
    /// A stem gave way.
    FruitDetached {
        /// Fruit index.
        fruit: usize,
        /// Frame.
        frame: u32,
        /// Stem tension [N].
        tension: f64,
    },
    /// A fruit came to rest in the bucket. If it leaves the bucket later, nothing is told until it meets the ground
    /// ([`WorldEvent::FruitDropped`]) or comes to rest in the bucket again (this event once more).
    FruitDeposited {
        /// Fruit index.
        fruit: usize,
        /// Frame.
        frame: u32,
        /// How far it fell from where the fingers (or its stem) let go to the first thing that it landed on [m].
        drop_height: f64,
        /// Energy of the hardest impact since then [J].
        impact_energy: f64,
    },
    /// The hardest impact of a fruit in this frame, where its energy is over `fruit.impact_floor`.
    FruitImpact {
        /// Fruit index.
        fruit: usize,
        /// Frame.
        frame: u32,
        /// Energy of the approach [J].
        energy: f64,
        /// What it was with.
        partner: Partner,
    },
    /// A loose fruit touched the ground for the first time since it left its stem, or since it last lay in the bucket.
    FruitDropped {
        /// Fruit index.
        fruit: usize,
        /// Frame.
        frame: u32,
        /// Speed just before [m/s].
        speed: f64,
    },
    /// A joint of the tree broke.
    BranchSnapped {
        /// Segment whose base joint broke.
        segment: usize,
        /// Frame.
        frame: u32,
    },
}

impl WorldEvent {
    /// What befell a fruit in a frame.
    pub(crate) fn of_fruit(event: FruitEvent, frame: u32) -> Self {
        match event {
            FruitEvent::Detached { fruit, tension } => Self::FruitDetached { fruit, frame, tension },
            FruitEvent::Deposited { fruit, drop_height, impact_energy } => {
                Self::FruitDeposited { fruit, frame, drop_height, impact_energy }
            }
            FruitEvent::Struck(Impact { fruit, partner, energy }) => {
                Self::FruitImpact { fruit, frame, energy, partner }
            }
            FruitEvent::Dropped { fruit, speed } => Self::FruitDropped { fruit, frame, speed },
        }
    }
}

/// Whether a world can go on.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Status {
    /// It runs.
    #[default]
    Running,
    /// Something became non-finite or left the plausible box; the world stands still from then on.
    Quarantined {
        /// Frame.
        frame: u32,
        /// What was found.
        reason: String,
    },
}
