//! Errors of data sets.

use orchard_bench::store::StoreError;
use orchard_world::WorldError;

/// Reason why a data set was not made.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// The protocol does not have the scenario's rules.
    #[error(transparent)]
    Rules(#[from] orchard_quantity::ConfigError),
    /// No seed in the range.
    #[error("--seeds {first}..{end} is empty: the end is not included and must be greater than the start")]
    NoSeeds {
        /// The first seed.
        first: u64,
        /// Seed after the last.
        end: u64,
    },
    /// A number of trees or views that is 0.
    #[error("--{option} 0: must be at least 1")]
    Nothing {
        /// Option that is 0.
        option: &'static str,
    },
    /// More images than `MOST_VIEWS`.
    #[error("{0} (seeds x trees x views) exceeds the limit of {MOST_VIEWS} images per data set")]
    TooMany(String),
    /// A colour image that takes too much memory.
    #[error(
        "--supersampling {side}: {width} x {height} pixels with {side} x {side} samples each exceed the limit of {most} samples per image"
    )]
    Samples {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Samples a pixel side.
        side: u32,
        /// Largest number of samples.
        most: u64,
    },
    /// A folder that cannot hold this data set.
    #[error("--out {folder}: {problem}")]
    Folder {
        /// The folder.
        folder: String,
        /// Reason.
        problem: String,
    },
    /// A tree that cannot be grown.
    #[error("seed {seed}, tree {tree}: {source}")]
    World {
        /// Seed.
        seed: u64,
        /// World under the seed.
        tree: u32,
        /// Reason.
        source: WorldError,
    },
    /// More instances of a class than a 16-bit image can number.
    #[error("seed {seed}, tree {tree}: {class} {instance} exceeds the range of a 16-bit instance image")]
    Instance {
        /// Seed.
        seed: u64,
        /// World under the seed.
        tree: u32,
        /// The class.
        class: &'static str,
        /// Instance.
        instance: u32,
    },
    /// An image that cannot be encoded.
    #[error("cannot encode an image: {0}")]
    Png(String),
    /// A file cannot be written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The stop flag was raised. Complete trees are stored and will be reused.
    #[error("interrupted: {done} of {total} trees are complete; run the same command again to continue")]
    Interrupted {
        /// Trees stored.
        done: usize,
        /// Trees in the plan.
        total: usize,
    },
}

impl DatasetError {
    /// True if the user's input is invalid.
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::NoSeeds { .. }
            | Self::Nothing { .. }
            | Self::TooMany(_)
            | Self::Samples { .. }
            | Self::Folder { .. }
            | Self::World { .. }
            | Self::Instance { .. }
            | Self::Rules(_) => true,
            Self::Png(_) | Self::Store(_) | Self::Threads(_) | Self::Interrupted { .. } => false,
        }
    }
}

/// Largest number of images of a data set: far more than a folder can practically hold, far fewer than the image numbers allow.
pub const MOST_VIEWS: u64 = 10_000_000;
