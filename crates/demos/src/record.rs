//! The record of one episode, written after its files.

use orchard_bench::digest::sha256;
use orchard_bench::record::Record;
use orchard_env::{Statistics, Task, Via};
use orchard_scenario::Names;
use serde::{Deserialize, Serialize};

use crate::config::SplitRules;

/// Key of an episode: all inputs that determine it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DemoKey {
    /// Layout version.
    pub schema_version: u32,
    /// [`orchard_bench::CODE_VERSION`].
    pub code_version: String,
    /// SHA-256 over scenario, protocol, conventions and figures, hexadecimal.
    pub config_hash: String,
    /// Names of world, robot, camera, detector and controller.
    #[serde(flatten)]
    pub scenario: Names,
    /// The task.
    pub task: Task,
    /// The way of the controller's commands to the robot.
    pub via: Via,
    /// Seed.
    pub seed: u64,
    /// World index under the seed.
    pub world: u32,
}

/// Use of a tree: training, validation or tests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// Training.
    Train,
    /// Validation.
    Validation,
    /// Tests.
    Test,
}

impl Split {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Validation => "validation",
            Self::Test => "test",
        }
    }

    /// The use of a tree, by the SHA-256 of its text (hexadecimal): the first 48 bits, as a share of all values, lie below the share of
    /// tests, of validation, or above both.
    pub fn of(tree_sha256: &str, rules: &SplitRules) -> Self {
        let bits = tree_sha256.get(..12).and_then(|digits| u64::from_str_radix(digits, 16).ok());
        let share = bits.unwrap_or(0) as f64 / (1_u64 << 48) as f64;
        let test = rules.test.si();
        match share {
            x if x < test => Self::Test,
            x if x < test + rules.validation.si() => Self::Validation,
            _ => Self::Train,
        }
    }
}

/// A file that was written.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileRecord {
    /// Path relative to the folder.
    pub path: String,
    /// SHA-256, hexadecimal.
    pub sha256: String,
}

impl FileRecord {
    /// The record of a file's bytes.
    pub fn of(path: &str, bytes: &[u8]) -> Self {
        Self { path: path.to_owned(), sha256: sha256(bytes) }
    }
}

/// The images of an episode.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImagesRecord {
    /// Number of files.
    pub count: u32,
    /// SHA-256 over their paths and bytes with the lengths of both (8 bytes, little-endian, before each), in the order of the steps.
    pub sha256: String,
    /// Pixels whose depth is outside the range of the depth images; they are written as 0, not measured.
    pub unfit_depth_px: u64,
}

/// Distance between the actions and what the controller commanded, by channel, in the channel's unit.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ActionError {
    /// Mean over the steps of the largest difference in a step.
    pub mean: Vec<f64>,
    /// Largest difference.
    pub largest: Vec<f64>,
    /// Share of the steps whose action is at an end, 1 or -1.
    pub saturated: Vec<f64>,
}

/// Record of a demonstration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Demonstration {
    /// Seed of the world, and its index: another one than the key's where that one has no target.
    pub drawn: (u64, u32),
    /// SHA-256 of the tree (`orchard export-tree --format json`), hexadecimal.
    pub tree_sha256: String,
    /// Use of the tree.
    pub split: Split,
    /// The task in words.
    pub task_description: String,
    /// End of the episode, by the benchmark's word.
    pub outcome: String,
    /// True if it ended with the task done.
    pub success: bool,
    /// Rewards, costs, time and damage of the whole episode.
    pub statistics: Statistics,
    /// Frames.
    pub frames: u32,
    /// Error of the actions.
    pub action_error: ActionError,
    /// SHA-256 of the environment's state at the end, hexadecimal.
    pub end_state_sha256: String,
    /// Table of the steps.
    pub steps: FileRecord,
    /// Table of the commands, one row a frame.
    pub commands: FileRecord,
    /// Images.
    pub images: ImagesRecord,
}

/// One episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DemoRecord {
    /// Key: all inputs that determine the record.
    #[serde(flatten)]
    pub key: DemoKey,
    /// Reason why there is no episode, if so: a world that cannot be built, or no target in it and those after it.
    pub never_began: Option<String>,
    /// The demonstration; none if it never began.
    pub demonstration: Option<Demonstration>,
}

impl DemoRecord {
    /// Frames of the episode.
    pub fn frames(&self) -> u64 {
        self.demonstration.as_ref().map_or(0, |demo| u64::from(demo.frames))
    }
}

/// Stem of the names of an episode's files.
pub(crate) fn stem(key: &DemoKey) -> String {
    format!("{:06}-{:05}", key.seed, key.world)
}

impl Record for DemoRecord {
    type Key = DemoKey;

    const FOLDER: &'static str = "episodes";

    fn key(&self) -> &DemoKey {
        &self.key
    }

    fn file(key: &DemoKey) -> String {
        format!("{}.json", stem(key))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::DemosRules;

    #[test]
    fn trees_are_split_by_their_hash_alone() {
        let rules = DemosRules::v1().split;
        let of = |digits: &str| Split::of(&format!("{digits:0<64}"), &rules);
        assert_eq!((of("00"), of("19"), of("1a"), of("33"), of("34")), {
            (Split::Test, Split::Test, Split::Validation, Split::Validation, Split::Train)
        });
        let counted = (0..1000_u32).map(|i| Split::of(&sha256(&i.to_le_bytes()), &rules));
        let test = counted.filter(|split| *split == Split::Test).count();
        assert!((70..130).contains(&test), "{test}");
    }
}
