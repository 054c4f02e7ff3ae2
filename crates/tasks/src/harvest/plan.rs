//! Plans of the harvest task.

use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_bench::{PlanError, check_records, check_trees};
use orchard_scenario::Names;
use serde::{Deserialize, Serialize};

use crate::backend::Backend;
use crate::harvest::episode::EpisodeKey;
use crate::harvest::matrix::{Dials, MatrixSweep};
use crate::protocol::Protocol;
use crate::seeds::SeedSetLabel;

/// Extent of a run: the part of the matrix, its seeds and its time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Extent {
    /// Profile that set the defaults.
    pub profile: String,
    /// Names of conditions and sweeps.
    pub conditions: Vec<String>,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Trees per seed.
    pub trees: u32,
    /// Episodes per tree under the nominal condition.
    pub repeats: u32,
    /// Length of an episode under all conditions but `exhaustion` \[s\].
    pub horizon_s: f64,
}

/// The parameters of one condition of the benchmark matrix.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConditionParams {
    /// Worlds.
    #[serde(flatten)]
    pub dials: Dials,
    /// Trees per seed.
    pub trees: u32,
    /// Budget of an episode \[s\].
    pub horizon_s: f64,
    /// Episodes per tree, each with another start pose of the robot.
    pub repeats: u32,
}

/// One condition of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// Name.
    pub name: String,
    /// Parameters.
    pub params: ConditionParams,
}

/// A run: every condition on every tree of every seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Names of world, robot, camera, detector and controller.
    pub scenario: Names,
    /// [`orchard_scenario::Scenario::hash`].
    pub scenario_hash: String,
    /// Profile that set the defaults of the run.
    pub profile: String,
    /// Conditions, in order.
    pub conditions: Vec<Condition>,
    /// Sweeps of these conditions.
    pub sweeps: Vec<MatrixSweep>,
    /// Seed set.
    pub seed_set: SeedSetLabel,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Frame length \[s\].
    pub frame: f64,
    /// SHA-256 over scenario and protocol, from [`orchard_bench::digest::config_hash`].
    pub config_hash: String,
    /// Protocol constants.
    pub protocol: Protocol,
    /// Backend that moves the worlds.
    pub backend: Backend,
}

/// Longest budget \[s\]; prevents an overflow of frame counts.
const LONGEST_HORIZON: f64 = 360_000.0;

impl Plan {
    /// Checks the user's input.
    ///
    /// # Errors
    /// No condition, a condition given twice, no seed, a seed given twice, no tree, no repeat, a budget shorter than a frame, or too many
    /// episodes.
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
        let of = |condition: &Condition| {
            let ConditionParams { trees, repeats, .. } = condition.params;
            (self.seeds.len() as u64).saturating_mul(u64::from(trees)).saturating_mul(u64::from(repeats))
        };
        check_records(self.conditions.iter().map(of).fold(0, u64::saturating_add))
    }

    /// Budget of an episode under a condition \[frames\].
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
            backend: self.backend,
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
            Err("0 trees: at least 1 tree per seed is needed".into())
        );
        assert_eq!(
            check(|p| p.conditions[0].params.repeats = 0),
            Err("0 repeats: at least 1 episode per tree is needed".into())
        );
        let many =
            |p: &mut Plan| (p.conditions[0].params.trees, p.conditions[0].params.repeats) = (1000, 1000);
        assert!(check(many).unwrap_err().ends_with("records; a task has at most 100000"));
        for horizon in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut plan = plan();
            plan.conditions[0].params.horizon_s = horizon;
            assert!(matches!(plan.check(), Err(PlanError::Horizon { .. })), "{horizon}");
        }
    }
}
