//! What a benchmark run consists of.

use orchard_scenario::Names;
use serde::{Deserialize, Serialize};

use crate::digest::{FilesDigest, hex};
use crate::episode::{CODE_VERSION, EpisodeKey, SCHEMA_VERSION};
use crate::matrix::{Dials, MatrixSweep};
use crate::protocol::Protocol;
use crate::seeds::SeedSetLabel;

/// The parameters of one condition of the benchmark matrix.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConditionParams {
    /// Its worlds.
    #[serde(flatten)]
    pub dials: Dials,
    /// Trees a seed.
    pub trees: u32,
    /// Budget of an episode [s].
    pub horizon_s: f64,
    /// Episodes a tree, each with another start pose of the robot.
    pub repeats: u32,
}

/// One condition of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// Its name.
    pub name: String,
    /// Its parameters.
    pub params: ConditionParams,
}

/// A run: every condition on every tree of every seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Names of world, robot, camera, detector and controller.
    pub scenario: Names,
    /// [`orchard_scenario::Scenario::hash`].
    pub scenario_hash: String,
    /// Profile whose defaults the run took.
    pub profile: String,
    /// Conditions, in order.
    pub conditions: Vec<Condition>,
    /// The sweeps that they make up.
    pub sweeps: Vec<MatrixSweep>,
    /// The set that the seeds belong to.
    pub seed_set: SeedSetLabel,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Frame length [s].
    pub frame: f64,
    /// SHA-256 over scenario and protocol, from [`config_hash`].
    pub config_hash: String,
    /// Protocol constants.
    pub protocol: Protocol,
}

/// A plan that cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// No condition.
    #[error("no condition given")]
    NoConditions,
    /// A condition given twice.
    #[error("condition {0} is given twice")]
    ConditionTwice(String),
    /// No seed.
    #[error("no seed given")]
    NoSeeds,
    /// A seed given twice.
    #[error("seed {0} is given twice")]
    SeedTwice(u64),
    /// No tree.
    #[error("0 trees: at least 1 tree a seed is needed")]
    NoTrees,
    /// No episode.
    #[error("0 repeats: at least 1 episode a tree is needed")]
    NoRepeats,
    /// A controller that cannot be given a goal.
    #[error("controller {0} takes no goals, which this task gives")]
    NoGoals(String),
    /// A budget that is not at least a frame or not a sensible number.
    #[error("a horizon of {horizon} s is not between one frame ({frame:.4} s) and 100 hours")]
    Horizon {
        /// The budget [s].
        horizon: f64,
        /// Frame length [s].
        frame: f64,
    },
}

/// Longest budget [s]: keeps frame counts far from overflow.
const LONGEST_HORIZON: f64 = 360_000.0;

impl Plan {
    /// Checks what a user can get wrong.
    ///
    /// # Errors
    /// No condition, one given twice, no seed, a seed given twice, no tree, no repeat, a budget shorter than a frame.
    pub fn check(&self) -> Result<(), PlanError> {
        if self.conditions.is_empty() {
            return Err(PlanError::NoConditions);
        }
        for (i, condition) in self.conditions.iter().enumerate() {
            if self.conditions[..i].iter().any(|other| other.name == condition.name) {
                return Err(PlanError::ConditionTwice(condition.name.clone()));
            }
            let params = &condition.params;
            check_trees(&self.seeds, params.trees)?;
            if params.repeats == 0 {
                return Err(PlanError::NoRepeats);
            }
            if !(self.frame..=LONGEST_HORIZON).contains(&params.horizon_s) {
                return Err(PlanError::Horizon { horizon: params.horizon_s, frame: self.frame });
            }
        }
        Ok(())
    }

    /// Budget of an episode under a condition [frames].
    pub fn horizon_frames(&self, condition: &Condition) -> u32 {
        (condition.params.horizon_s / self.frame).round() as u32
    }

    /// The keys of all episodes, condition by condition, seed by seed, tree by tree.
    pub fn episodes(&self) -> Vec<EpisodeKey> {
        let key = |condition: &Condition, seed, world, repeat| EpisodeKey {
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            config_hash: self.config_hash.clone(),
            scenario: self.scenario.clone(),
            condition: condition.name.clone(),
            seed,
            world,
            repeat,
            horizon_frames: self.horizon_frames(condition),
        };
        let of = |condition: &Condition| -> Vec<EpisodeKey> {
            let worlds = |&seed: &u64| (0..condition.params.trees).map(move |world| (seed, world));
            let repeats =
                |(seed, world)| (0..condition.params.repeats).map(move |r| key(condition, seed, world, r));
            self.seeds.iter().flat_map(worlds).flat_map(repeats).collect()
        };
        self.conditions.iter().flat_map(of).collect()
    }
}

/// Checks the seeds and the number of trees a seed.
pub(crate) fn check_trees(seeds: &[u64], trees: u32) -> Result<(), PlanError> {
    if seeds.is_empty() {
        return Err(PlanError::NoSeeds);
    }
    for (i, seed) in seeds.iter().enumerate() {
        if seeds[..i].contains(seed) {
            return Err(PlanError::SeedTwice(*seed));
        }
    }
    if trees == 0 { Err(PlanError::NoTrees) } else { Ok(()) }
}

/// SHA-256 over named config texts, hexadecimal. Names and lengths are hashed too, so that text cannot move
/// from one file to another unnoticed.
pub fn config_hash(texts: &[(&str, &str)]) -> String {
    let mut digest = FilesDigest::default();
    for (name, text) in texts {
        digest.add(name, text.as_bytes());
    }
    hex(&digest.finish())
}

/// A config as text, for [`config_hash`]: the order of fields and the shortest digits that give a number back are the same
/// everywhere.
pub(crate) fn config_text(config: &impl Serialize) -> String {
    serde_json::to_string(config).unwrap_or_else(|e| unreachable!("config from TOML is also JSON: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::plan;

    #[test]
    fn what_a_user_can_get_wrong() {
        let check = |change: fn(&mut Plan)| {
            let mut plan = plan();
            change(&mut plan);
            plan.check().map_err(|e| e.to_string())
        };
        assert_eq!(check(|_| ()), Ok(()));
        assert_eq!(check(|p| p.conditions.clear()), Err("no condition given".into()));
        let twice = |p: &mut Plan| p.conditions.push(p.conditions[0].clone());
        assert_eq!(check(twice), Err("condition nominal is given twice".into()));
        assert_eq!(check(|p| p.seeds.clear()), Err("no seed given".into()));
        assert_eq!(check(|p| p.seeds = vec![4, 5, 4]), Err("seed 4 is given twice".into()));
        assert_eq!(
            check(|p| p.conditions[0].params.trees = 0),
            Err("0 trees: at least 1 tree a seed is needed".into())
        );
        assert_eq!(
            check(|p| p.conditions[0].params.repeats = 0),
            Err("0 repeats: at least 1 episode a tree is needed".into())
        );
        for horizon in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut plan = plan();
            plan.conditions[0].params.horizon_s = horizon;
            assert!(matches!(plan.check(), Err(PlanError::Horizon { .. })), "{horizon}");
        }
    }

    #[test]
    fn hash_tells_texts_and_places_apart() {
        let hashes = [
            config_hash(&[("a", "xy"), ("b", "z")]),
            config_hash(&[("a", "x"), ("b", "yz")]),
            config_hash(&[("b", "xy"), ("a", "z")]),
        ];
        assert_ne!(hashes[0], hashes[1]);
        assert_ne!(hashes[0], hashes[2]);
        // SHA-256 of nothing.
        assert!(config_hash(&[]).starts_with("e3b0c44298fc1c14"));
    }
}
