//! What happens in a world, told with the frame in which it did.

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
    /// A fruit came to rest in the bucket.
    FruitDeposited {
        /// Fruit index.
        fruit: usize,
        /// Frame.
        frame: u32,
    },
    /// A loose fruit touched the ground for the first time.
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
