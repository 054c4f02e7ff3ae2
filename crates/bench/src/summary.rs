//! `summary.json`: the metrics of a run, by condition.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::bootstrap::Resamples;
use crate::episode::{CODE_VERSION, EpisodeRecord, Outcome, SCHEMA_VERSION};
use crate::metrics::{METRICS, Metric, estimate};
use crate::plan::{ConditionParams, Plan};
use crate::record::Record;
use crate::zones::{ZoneTable, zone_table};

/// A whole run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Layout version.
    pub schema_version: u32,
    /// Code version.
    pub code_version: String,
    /// SHA-256 of all config texts.
    pub config_hash: String,
    /// Preset of the config.
    pub preset: String,
    /// Profile.
    pub profile: String,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Results by condition.
    pub conditions: BTreeMap<String, ConditionSummary>,
}

/// Results of one condition.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConditionSummary {
    /// Its parameters.
    pub params: ConditionParams,
    /// One line an episode.
    pub episodes: Vec<EpisodeLine>,
    /// Episodes by the way they ended.
    pub outcomes: BTreeMap<String, u32>,
    /// Estimates by name.
    pub metrics: BTreeMap<String, Metric>,
    /// Results by canopy zone, pooled over trees.
    pub zones: ZoneTable<ZoneSummary>,
    /// Failed attempts by reason.
    pub failures: BTreeMap<String, u32>,
}

/// An episode in short.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeLine {
    /// File under the result folder.
    pub file: String,
    /// Seed.
    pub seed: u64,
    /// World index.
    pub world: u32,
    /// How it ended.
    pub outcome: Outcome,
    /// Simulated time [s].
    pub duration_s: f64,
    /// Fruit on the tree at the start.
    pub fruit: u32,
    /// Of these, inside the reach sphere.
    pub reachable: u32,
    /// Attempts.
    pub attempts: u32,
    /// Fruit deposited (0 in a quarantined world).
    pub deposited: u32,
    /// Fruit dropped.
    pub dropped: u32,
    /// Branches snapped.
    pub snapped: u32,
}

/// One zone, pooled over trees.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ZoneSummary {
    /// Reachable fruit at the start.
    pub reachable: u32,
    /// Reachable fruit deposited.
    pub deposited: u32,
    /// Attempts on targets in the zone.
    pub attempts: u32,
    /// Of these, placed.
    pub placed: u32,
    /// Placed over attempts; null without attempts.
    pub place_success: Option<f64>,
    /// Deposited over reachable; null without reachable fruit.
    pub completeness: Option<f64>,
}

impl Summary {
    /// Sums up the episodes of a plan, given in the order of [`Plan::episodes`].
    pub fn of_run(plan: &Plan, episodes: &[EpisodeRecord]) -> Self {
        let groups: Vec<Vec<usize>> = plan
            .seeds
            .iter()
            .map(|seed| (0..episodes.len()).filter(|&i| episodes[i].key.seed == *seed).collect())
            .collect();
        let resamples = Resamples::draw(&groups, &plan.protocol.bootstrap);
        let condition = ConditionSummary {
            params: plan.params.clone(),
            episodes: episodes.iter().map(line).collect(),
            outcomes: count(episodes.iter().map(|e| status(&e.outcome).to_owned())),
            metrics: estimate(METRICS, episodes, &resamples),
            zones: zones(episodes),
            failures: count(
                episodes.iter().flat_map(|e| &e.attempts).filter_map(|a| a.failure_reason.clone()),
            ),
        };
        Self {
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            config_hash: plan.config_hash.clone(),
            preset: plan.preset.clone(),
            profile: plan.profile.clone(),
            seeds: plan.seeds.clone(),
            conditions: BTreeMap::from([(plan.condition.clone(), condition)]),
        }
    }
}

fn status(outcome: &Outcome) -> &'static str {
    match outcome {
        Outcome::BudgetSpent => "budget_spent",
        Outcome::AllReachablePicked => "all_reachable_picked",
        Outcome::Stalled => "stalled",
        Outcome::Quarantined { .. } => "quarantined",
    }
}

fn count(names: impl Iterator<Item = String>) -> BTreeMap<String, u32> {
    let mut counts = BTreeMap::new();
    for name in names {
        *counts.entry(name).or_insert(0) += 1;
    }
    counts
}

fn line(e: &EpisodeRecord) -> EpisodeLine {
    EpisodeLine {
        file: EpisodeRecord::path(&e.key),
        seed: e.key.seed,
        world: e.key.world,
        outcome: e.outcome.clone(),
        duration_s: e.duration_s,
        fruit: e.fruit_total,
        reachable: e.reachable_count,
        attempts: e.attempts.len() as u32,
        deposited: e.deposited().count() as u32,
        dropped: e.dropped().count() as u32,
        snapped: e.branches_snapped.len() as u32,
    }
}

fn zones(episodes: &[EpisodeRecord]) -> ZoneTable<ZoneSummary> {
    let mut table = zone_table(ZoneSummary::default());
    for e in episodes {
        for (zone, reachable) in &e.zone_census {
            table.entry(*zone).or_default().reachable += reachable;
        }
        for zone in e.deposited().filter(|f| f.reachable).filter_map(|f| f.zone) {
            table.entry(zone).or_default().deposited += 1;
        }
        for zone in e.attempts.iter().filter_map(|a| a.zone) {
            table.entry(zone).or_default().attempts += 1;
        }
        for zone in e.placed().filter_map(|a| a.zone) {
            table.entry(zone).or_default().placed += 1;
        }
    }
    let rate = |n: u32, of: u32| (of > 0).then(|| f64::from(n) / f64::from(of));
    for summary in table.values_mut() {
        summary.place_success = rate(summary.placed, summary.attempts);
        summary.completeness = rate(summary.deposited, summary.reachable);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::FruitState;
    use crate::fake::{attempt, plan, record};
    use crate::zones::Zone;

    #[test]
    fn layout_and_counts() {
        let mut a = record(&[(FruitState::Deposited, true), (FruitState::OnTree, true)]);
        a.key.seed = 1;
        a.attempts = vec![attempt(Some(5.0), 1, 1), attempt(None, 0, 0)];
        let mut b = record(&[]);
        b.key.seed = 2;
        b.attempts = vec![attempt(None, 0, 0)];
        b.outcome = Outcome::Quarantined { reason: "not finite".into() };
        let mut plan = plan();
        (plan.seeds, plan.params.trees) = (vec![1, 2], 1);
        let summary = Summary::of_run(&plan, &[a, b]);
        let json = serde_json::to_value(&summary).unwrap();
        for field in ["schema_version", "code_version", "preset", "profile", "seeds", "conditions"] {
            assert!(json.get(field).is_some(), "{field}");
        }
        let nominal = &json["conditions"]["nominal"];
        for field in ["params", "episodes", "metrics", "zones", "failures"] {
            assert!(nominal.get(field).is_some(), "{field}");
        }
        assert_eq!(nominal["outcomes"]["quarantined"], 1);
        assert_eq!(nominal["episodes"][1]["outcome"]["reason"], "not finite");
        assert_eq!(nominal["failures"]["blocked"], 2);
        let zone = &summary.conditions["nominal"].zones[&Zone::MiddleInner];
        assert_eq!((zone.reachable, zone.deposited, zone.attempts, zone.placed), (2, 1, 3, 1));
        assert_eq!(zone.completeness, Some(0.5));
        assert_eq!(summary.conditions["nominal"].zones[&Zone::UpperOuter].place_success, None);
    }
}
