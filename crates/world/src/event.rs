//! Events of a world, each with its frame: the one event vocabulary from the world to the records of a benchmark.

use orchard_fruit::{Impact, LooseEvent, Partner, Release};
use serde::{Deserialize, Serialize};

/// Event that a benchmark counts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum WorldEvent {
    /// Both fingers press on a fruit for the first time since both last let go; or the suction cup seals on it for the first time since it last
    /// touched it.
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
        /// Stem tension \[N\].
        tension: f64,
        /// Way in which it came off a stem that bends; `None` on a tether.
        release: Option<Release>,
    },
    /// A fruit came to rest in the bucket. If it leaves the bucket later, the next event is its touch of the ground
    /// ([`WorldEvent::FruitDropped`]) or its rest in the bucket (this event again).
    FruitDeposited {
        /// Fruit index.
        fruit: usize,
        /// Frame.
        frame: u32,
        /// Height that it fell from where the fingers (or its stem) released it to its first contact \[m\].
        drop_height: f64,
        /// Energy of the hardest impact since then \[J\].
        impact_energy: f64,
    },
    /// The hardest impact of a fruit in this frame, where its energy is over `fruit.impact_floor`.
    FruitImpact {
        /// Fruit index.
        fruit: usize,
        /// Frame.
        frame: u32,
        /// Energy of the approach \[J\].
        energy: f64,
        /// Body that it collided with.
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
    /// A finger or the suction cup begins to press on a fruit that neither pressed on in the frame before.
    FingerContactBegan {
        /// Fruit index.
        fruit: usize,
        /// Frame: the first with contact.
        frame: u32,
    },
    /// No finger and no suction cup presses on a fruit any more.
    FingerContactEnded {
        /// Fruit index.
        fruit: usize,
        /// Frame: the first without contact.
        frame: u32,
    },
    /// The suction cup lost its seal on a fruit although its valve was open: the vacuum fell below the cup's grip vacuum, or the lip left the
    /// fruit.
    SealLost {
        /// Fruit index.
        fruit: usize,
        /// Frame: the first without the seal.
        frame: u32,
    },
    /// A fruit that lay in the bucket left the field with it: a helper exchanged the bucket for an empty one.
    FruitTakenAway {
        /// Fruit index.
        fruit: usize,
        /// Frame.
        frame: u32,
    },
}

impl WorldEvent {
    /// Adds the frame to an event of a fruit.
    pub(crate) fn of_fruit(event: LooseEvent, frame: u32) -> Self {
        match event {
            LooseEvent::Detached { fruit, tension, release } => {
                Self::FruitDetached { fruit, frame, tension, release }
            }
            LooseEvent::Deposited { fruit, drop_height, impact_energy } => {
                Self::FruitDeposited { fruit, frame, drop_height, impact_energy }
            }
            LooseEvent::Struck(Impact { fruit, partner, energy }) => {
                Self::FruitImpact { fruit, frame, energy, partner }
            }
            LooseEvent::Dropped { fruit, speed } => Self::FruitDropped { fruit, frame, speed },
        }
    }
}

/// State of a world: running or quarantined.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Status {
    /// It runs.
    #[default]
    Running,
    /// Something became non-finite or left the plausible box; the world stands still from then on.
    Quarantined {
        /// Frame.
        frame: u32,
        /// Fault found.
        reason: String,
    },
}
