//! Test fixture: a small record.

use serde::{Deserialize, Serialize};

use crate::record::Record;
use crate::version::{CODE_VERSION, SCHEMA_VERSION};

/// Key of a [`Sum`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SumKey {
    pub schema_version: u32,
    pub code_version: String,
    pub config_hash: String,
    pub controller: String,
    pub seed: u64,
    pub world: u32,
    pub horizon_frames: u32,
}

/// The sum of seed and world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sum {
    #[serde(flatten)]
    pub key: SumKey,
    pub sum: u64,
}

impl Record for Sum {
    type Key = SumKey;
    const FOLDER: &'static str = "sums";

    fn key(&self) -> &SumKey {
        &self.key
    }

    fn file(key: &SumKey) -> String {
        format!("{}-{}-{:03}.json", key.controller, key.seed, key.world)
    }
}

/// Record of a world of seed 7.
pub fn record(world: u32) -> Sum {
    let key = keys().swap_remove(world as usize);
    Sum { sum: key.seed + u64::from(key.world), key }
}

/// Keys of 2 seeds x 4 worlds.
pub fn keys() -> Vec<SumKey> {
    let key = |seed, world| SumKey {
        schema_version: SCHEMA_VERSION,
        code_version: CODE_VERSION.into(),
        config_hash: "hash".into(),
        controller: "fake".into(),
        seed,
        world,
        horizon_frames: 60,
    };
    [7, 8].into_iter().flat_map(|seed| (0..4).map(move |world| key(seed, world))).collect()
}
