//! `summary.json`: the metrics of a run, by condition.

mod sweeps;
mod zones;

pub use sweeps::{Adjusted, Sweep, SweepComparison};
pub use zones::ZoneSummary;

use std::collections::BTreeMap;

use orchard_bench::record::Record;
use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_scenario::Names;
use orchard_statistics::bootstrap::ratio;
use orchard_statistics::{Design, Resamples, VarianceComponents};
use orchard_statistics::{Metric, components_of_metrics, estimate, estimate_quantiles};
use serde::{Deserialize, Serialize};

use crate::backend::Backend;
use crate::harvest::episode::{AttemptOutcome, EpisodeRecord, Outcome};
use crate::harvest::metrics::{METRICS, QUANTILES, completeness};
use crate::harvest::plan::{Condition, ConditionParams, Plan};
use crate::seeds::SeedSetLabel;
use crate::zones::ZoneTable;

/// A whole run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Layout version.
    pub schema_version: u32,
    /// Code version.
    pub code_version: String,
    /// SHA-256 over scenario and protocol.
    pub config_hash: String,
    /// Version of protocol and configs.
    pub config_version: String,
    /// Preset of the config.
    pub preset: String,
    /// Scenario of the run.
    pub scenario: ScenarioLine,
    /// Profile.
    pub profile: String,
    /// Controller.
    pub controller: String,
    /// Backend that moved the worlds; left out for the processor.
    #[serde(default, skip_serializing_if = "Backend::is_cpu")]
    pub backend: Backend,
    /// Seed set.
    pub seed_set: SeedSetLabel,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Number of quarantined worlds of all conditions; they count as zero harvest.
    pub quarantined: u32,
    /// Number of episodes in which the controller gave up, by reason; left out where it never did.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub gave_up: BTreeMap<String, u32>,
    /// Results by condition.
    pub conditions: BTreeMap<String, ConditionSummary>,
    /// Conditions along a dial, by sweep.
    pub sweeps: BTreeMap<String, Sweep>,
}

/// Names and hash of a scenario.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScenarioLine {
    /// Names of all parts.
    #[serde(flatten)]
    pub names: Names,
    /// [`orchard_scenario::Scenario::hash`].
    pub hash: String,
}

/// Results of one condition.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConditionSummary {
    /// Parameters.
    pub params: ConditionParams,
    /// One entry per episode.
    pub episodes: Vec<EpisodeLine>,
    /// Number of episodes by outcome.
    pub outcomes: BTreeMap<String, u32>,
    /// Estimates by name.
    pub metrics: BTreeMap<String, Metric>,
    /// Variance between seeds, between trees and within a tree, by metric; absent without repeats.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variance: Option<BTreeMap<String, VarianceComponents>>,
    /// Results by canopy zone, pooled over trees.
    pub zones: ZoneTable<ZoneSummary>,
    /// Failed attempts by reason.
    pub failures: BTreeMap<String, u32>,
    /// Contact attempts by outcome.
    pub contact_outcomes: BTreeMap<String, u32>,
    /// Faults that the controller told, by alarm; left out where it told none.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub alarms: BTreeMap<String, u32>,
    /// Time in each state of an attempt.
    pub states: BTreeMap<String, StateSummary>,
    /// Mean time from the end of an attempt to the next commitment \[s\]; null without a next commitment.
    pub between_attempts_s: Option<f64>,
}

/// One state of the controller, over the attempts that entered it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StateSummary {
    /// Attempts that entered it.
    pub attempts: u32,
    /// Mean time in it \[s\].
    pub mean_s: Option<f64>,
    /// Number of these that were placed.
    pub placed: u32,
    /// Mean time in it of the placed attempts \[s\]; null without a placed attempt.
    pub mean_placed_s: Option<f64>,
}

/// Summary of an episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeLine {
    /// File under the result folder.
    pub file: String,
    /// Seed.
    pub seed: u64,
    /// World index.
    pub world: u32,
    /// Repeat number, from 0.
    pub repeat: u32,
    /// Outcome of the episode.
    pub outcome: Outcome,
    /// Simulated time \[s\].
    pub duration_s: f64,
    /// Fruit on the tree at the start.
    pub fruit: u32,
    /// Of these, inside the reach sphere.
    pub reachable: u32,
    /// Of these, confirmed by inverse kinematics; null where not computed.
    pub reachable_by_ik: Option<u32>,
    /// Reachable fruit deposited over reachable fruit; null without reachable fruit.
    pub completeness: Option<f64>,
    /// Declared attempts.
    pub attempts: u32,
    /// Contact attempts.
    pub contact_attempts: u32,
    /// Fruit deposited (0 in a quarantined world).
    pub deposited: u32,
    /// Fruit dropped.
    pub dropped: u32,
    /// Branches snapped.
    pub snapped: u32,
    /// Stem-pulled fruit.
    pub stem_pulled: u32,
    /// Fruit deposited with a bruise.
    pub bruised: u32,
}

impl Summary {
    /// Sums up the episodes of a plan, given in the order of [`Plan::episodes`].
    pub fn of_run(plan: &Plan, episodes: &[EpisodeRecord]) -> Self {
        let of = |condition: &Condition| {
            let own: Vec<&EpisodeRecord> =
                episodes.iter().filter(|e| e.key.condition == condition.name).collect();
            (condition.name.clone(), summed_up(plan, condition, &own))
        };
        Self {
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            config_hash: plan.config_hash.clone(),
            config_version: plan.protocol.version.clone(),
            preset: plan.scenario.scene.preset.clone(),
            scenario: ScenarioLine { names: plan.scenario.clone(), hash: plan.scenario_hash.clone() },
            profile: plan.profile.clone(),
            controller: plan.scenario.controller.clone(),
            backend: plan.backend,
            seed_set: plan.seed_set.clone(),
            seeds: plan.seeds.clone(),
            quarantined: episodes.iter().filter(|e| e.quarantined()).count() as u32,
            gave_up: count(episodes.iter().filter_map(|e| Some(e.gave_up.as_ref()?.fault.clone()))),
            conditions: plan.conditions.iter().map(of).collect(),
            sweeps: sweeps::sweeps(plan, episodes),
        }
    }
}

/// One condition's episodes.
fn summed_up(plan: &Plan, condition: &Condition, episodes: &[&EpisodeRecord]) -> ConditionSummary {
    let design = Design::of(episodes.iter().map(|e| (e.key.seed, e.key.world)));
    let resamples = Resamples::of(design, &plan.protocol.bootstrap);
    let reasons = episodes.iter().flat_map(|e| &e.attempts).filter_map(|a| a.failure_reason.clone());
    ConditionSummary {
        params: condition.params.clone(),
        episodes: episodes.iter().map(|e| line(e)).collect(),
        outcomes: count(episodes.iter().map(|e| status(&e.outcome).to_owned())),
        metrics: {
            let mut metrics = estimate(METRICS, episodes, &resamples);
            metrics.append(&mut estimate_quantiles(QUANTILES, episodes, &resamples));
            metrics
        },
        variance: resamples
            .design()
            .has_repeats()
            .then(|| components_of_metrics(METRICS, episodes, resamples.design())),
        zones: zones::zones(episodes, &resamples),
        failures: count(reasons),
        contact_outcomes: count(
            episodes.iter().flat_map(|e| &e.contact_attempts).map(|a| a.outcome.name().to_owned()),
        ),
        alarms: count(episodes.iter().flat_map(|e| &e.alarms).map(|told| told.alarm.clone())),
        states: states(episodes),
        between_attempts_s: between_attempts(episodes),
    }
}

fn states(episodes: &[&EpisodeRecord]) -> BTreeMap<String, StateSummary> {
    // By state: times of all attempts and of the placed ones.
    let mut times: BTreeMap<String, [Vec<f64>; 2]> = BTreeMap::new();
    for attempt in episodes.iter().flat_map(|e| &e.attempts) {
        for (state, time) in attempt.state_durations() {
            let [all, placed] = times.entry(state).or_default();
            all.push(time);
            if attempt.outcome == AttemptOutcome::Placed {
                placed.push(time);
            }
        }
    }
    let summed = |[all, placed]: [Vec<f64>; 2]| StateSummary {
        attempts: all.len() as u32,
        mean_s: mean(&all),
        placed: placed.len() as u32,
        mean_placed_s: mean(&placed),
    };
    times.into_iter().map(|(state, times)| (state, summed(times))).collect()
}

fn between_attempts(episodes: &[&EpisodeRecord]) -> Option<f64> {
    let gaps = |e: &&EpisodeRecord| -> Vec<f64> {
        e.attempts.windows(2).map(|pair| pair[1].start_time - pair[0].end_time).collect()
    };
    mean(&episodes.iter().flat_map(gaps).collect::<Vec<f64>>())
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
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
        repeat: e.key.repeat,
        outcome: e.outcome.clone(),
        duration_s: e.duration_s,
        fruit: e.fruit_total,
        reachable: e.reachable_count,
        reachable_by_ik: e.reachable_ik_count,
        completeness: ratio(std::iter::once(completeness(e))),
        attempts: e.attempts.len() as u32,
        contact_attempts: e.contact_attempts.len() as u32,
        deposited: e.deposited().count() as u32,
        dropped: e.dropped().count() as u32,
        snapped: e.branches_snapped.len() as u32,
        stem_pulled: e.stem_pulled().count() as u32,
        bruised: e.bruised().count() as u32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::{attempt, contact_attempt, plan, record};
    use crate::harvest::episode::{AttemptRecord, ContactOutcome, FruitState, StateTime};
    use crate::zones::Zone;

    #[test]
    fn layout_and_counts() {
        let mut a = record(&[(FruitState::Deposited, true), (FruitState::OnTree, true)]);
        a.key.seed = 1;
        a.attempts = vec![attempt(Some(5.0), 1, 1), attempt(None, 0, 0)];
        let mut b = record(&[]);
        b.key.seed = 2;
        b.attempts = vec![attempt(None, 0, 0)];
        a.contact_attempts =
            [ContactOutcome::Placed, ContactOutcome::LeftOnTree].map(|o| contact_attempt(0, o)).into();
        b.outcome = Outcome::Quarantined { reason: "not finite".into() };
        let mut plan = plan();
        (plan.seeds, plan.conditions[0].params.trees) = (vec![1, 2], 1);
        let summary = Summary::of_run(&plan, &[a, b]);
        let json = serde_json::to_value(&summary).unwrap();
        for field in [
            "schema_version",
            "code_version",
            "config_version",
            "config_hash",
            "seed_set",
            "preset",
            "profile",
            "controller",
            "seeds",
            "quarantined",
            "conditions",
            "sweeps",
        ] {
            assert!(json.get(field).is_some(), "{field}");
        }
        let nominal = &json["conditions"]["nominal"];
        for field in ["params", "episodes", "metrics", "zones", "failures", "states"] {
            assert!(nominal.get(field).is_some(), "{field}");
        }
        assert!(nominal.get("variance").is_none(), "no tree was repeated");
        assert_eq!(nominal["outcomes"]["quarantined"], 1);
        assert_eq!(nominal["episodes"][1]["outcome"]["reason"], "not finite");
        assert_eq!(nominal["failures"]["blocked"], 2);
        assert_eq!(nominal["contact_outcomes"], serde_json::json!({ "left_on_tree": 1, "placed": 1 }));
        assert_eq!(nominal["episodes"][0]["contact_attempts"], 2);
        let zone = &summary.conditions["nominal"].zones[&Zone::MiddleInner];
        assert_eq!((zone.reachable, zone.deposited, zone.attempts, zone.placed), (2, 1, 3, 1));
        assert_eq!(zone.completeness, Some(0.5));
        assert_eq!(summary.conditions["nominal"].zones[&Zone::UpperOuter].place_success, None);
    }

    /// Two trees, the first with 1 and 3 of 4 fruit, the second with 2 and 2: within a tree (1/8) / 2 with 2 degrees of freedom, and trees
    /// that are equal: 0 - e over 2 repeats.
    #[test]
    fn repeats_give_variance_components() {
        let episode = |world, repeat, deposited: usize| {
            let fruit: Vec<(FruitState, bool)> = (0..4)
                .map(|i| (if i < deposited { FruitState::Deposited } else { FruitState::OnTree }, true))
                .collect();
            let mut e = record(&fruit);
            (e.key.world, e.key.repeat) = (world, repeat);
            e
        };
        let mut plan = plan();
        (plan.seeds, plan.conditions[0].params.trees) = (vec![1], 2);
        plan.conditions[0].params.repeats = 2;
        let episodes = [episode(0, 0, 1), episode(0, 1, 3), episode(1, 0, 2), episode(1, 1, 2)];
        let summary = Summary::of_run(&plan, &episodes);
        let nominal = &summary.conditions["nominal"];
        let metric = &nominal.metrics["harvest_completeness"];
        // Repeats stay with their tree, and both trees have a half.
        assert_eq!((metric.mean, metric.ci95, metric.n), (Some(0.5), [Some(0.5); 2], 4));
        let c = &nominal.variance.as_ref().unwrap()["harvest_completeness"];
        assert_eq!((c.within_tree.raw, c.between_trees.raw), (Some(0.0625), Some(-0.03125)));
        assert_eq!(c.between_trees.variance, Some(0.0));
        assert_eq!(c.between_seeds.undefined, Some(orchard_statistics::Undefined::OneSeed));
        assert_eq!(nominal.episodes.iter().map(|e| e.repeat).collect::<Vec<_>>(), [0, 1, 0, 1]);
        let json = serde_json::to_string(&summary).unwrap();
        assert_eq!(serde_json::from_str::<Summary>(&json).unwrap(), summary);
    }

    #[test]
    fn times_of_states_and_between_attempts() {
        let spent = |list: &[(&str, f64)], end: f64, cycle| {
            let states = list.iter().map(|&(state, time)| StateTime { state: state.into(), time }).collect();
            let start_time = list[0].1;
            AttemptRecord { states, start_time, end_time: end, ..attempt(cycle, 1, 1) }
        };
        let mut e = record(&[]);
        // Reach, grasp, and reach once more: a state's times of one attempt are added up.
        e.attempts = vec![
            spent(&[("reach", 1.0), ("grasp", 3.0), ("reach", 4.0)], 4.5, Some(3.5)),
            spent(&[("reach", 6.0)], 7.0, None),
        ];
        let states = states(&[&e]);
        let reach = &states["reach"];
        assert_eq!((reach.attempts, reach.mean_s), (2, Some((2.5 + 1.0) / 2.0)));
        assert_eq!((reach.placed, reach.mean_placed_s), (1, Some(2.5)));
        assert_eq!((states["grasp"].attempts, states["grasp"].mean_s), (1, Some(1.0)));
        assert_eq!(between_attempts(&[&e]), Some(1.5));
        assert_eq!(between_attempts(&[&record(&[])]), None);
    }

    #[test]
    fn conditions_are_summed_up_apart() {
        let mut plan = plan();
        (plan.seeds, plan.conditions[0].params.trees) = (vec![1], 1);
        let mut longer = plan.conditions[0].clone();
        longer.name = "exhaustion".into();
        plan.conditions.push(longer);
        let a = record(&[(FruitState::OnTree, true)]);
        let mut b = record(&[(FruitState::Deposited, true)]);
        b.key.condition = "exhaustion".into();
        b.frames = 1;
        let summary = Summary::of_run(&plan, &[a, b]);
        let completeness =
            |condition: &str| summary.conditions[condition].metrics["harvest_completeness"].mean;
        assert_eq!((completeness("nominal"), completeness("exhaustion")), (Some(0.0), Some(1.0)));
        assert_eq!(summary.conditions["exhaustion"].episodes.len(), 1);
    }
}
