//! Sums over the episodes of a folder.

use std::collections::BTreeMap;

use orchard_env::Via;
use serde::{Deserialize, Serialize};

use crate::plan::Plan;
use crate::record::{ActionError, DemoRecord, Demonstration, Split};

/// Sums over episodes.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Totals {
    /// Episodes.
    pub episodes: u32,
    /// Episodes that ended with the task done.
    pub successes: u32,
    /// Steps.
    pub steps: u64,
    /// Simulated time \[s\].
    pub time_s: f64,
    /// Fruit that came to rest in the bucket.
    pub deposited: u32,
    /// Mean of the completeness: fruit in the bucket by reachable fruit; for a named fruit 1 if it was held.
    pub mean_completeness: f64,
    /// Joints of the trees that broke.
    pub branches_snapped: u32,
    /// Falls of fruit to the ground.
    pub fruit_dropped: u32,
    /// Spurs that tore off.
    pub spurs_torn: u32,
    /// Images.
    pub images: u64,
    /// Pixels whose depth is outside the range of the depth images.
    pub unfit_depth_px: u64,
}

/// Error of the actions of a channel over all episodes, in the channel's unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelError {
    /// Name of the channel.
    pub channel: String,
    /// Unit of the differences.
    pub unit: String,
    /// Mean over the steps of the largest difference in a step.
    pub mean: f64,
    /// Largest difference.
    pub largest: f64,
    /// Share of the steps whose action is at an end.
    pub saturated: f64,
}

/// The summary, `summary.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DemosSummary {
    /// The controller.
    pub controller: String,
    /// The way of its commands to the robot.
    pub via: Via,
    /// All episodes.
    pub all: Totals,
    /// By the use of the trees.
    pub splits: BTreeMap<Split, Totals>,
    /// Different trees.
    pub trees: u32,
    /// Worlds without an episode.
    pub never_began: u32,
    /// Episodes by how they ended.
    pub outcomes: BTreeMap<String, u32>,
    /// Error of the actions by channel.
    pub action_error: Vec<ChannelError>,
}

impl Totals {
    fn add(&mut self, demo: &Demonstration) {
        let statistics = &demo.statistics;
        self.mean_completeness = (self.mean_completeness * f64::from(self.episodes)
            + statistics.completeness)
            / f64::from(self.episodes + 1);
        self.episodes += 1;
        self.successes += u32::from(demo.success);
        self.steps += u64::from(statistics.length);
        self.time_s += statistics.time;
        self.deposited += statistics.deposited;
        self.branches_snapped += statistics.damage.branches_snapped;
        self.fruit_dropped += statistics.damage.fruit_dropped;
        self.spurs_torn += statistics.damage.spurs_torn;
        self.images += u64::from(demo.images.count);
        self.unfit_depth_px += demo.images.unfit_depth_px;
    }
}

impl DemosSummary {
    /// Sums up the records of a plan.
    pub fn of(plan: &Plan, records: &[DemoRecord]) -> Self {
        let demos = || records.iter().filter_map(|record| record.demonstration.as_ref());
        let (mut all, mut splits) = (Totals::default(), BTreeMap::<Split, Totals>::new());
        let mut outcomes = BTreeMap::new();
        for demo in demos() {
            all.add(demo);
            splits.entry(demo.split).or_default().add(demo);
            *outcomes.entry(demo.outcome.clone()).or_insert(0) += 1;
        }
        let trees: std::collections::BTreeSet<&str> = demos().map(|demo| demo.tree_sha256.as_str()).collect();
        let weighted = |of: &dyn Fn(&ActionError) -> &Vec<f64>, i: usize| -> f64 {
            let sum = |demo: &Demonstration| {
                f64::from(demo.statistics.length) * of(&demo.action_error).get(i).copied().unwrap_or(0.0)
            };
            demos().map(sum).sum::<f64>() / all.steps.max(1) as f64
        };
        let largest = |i: usize| {
            demos().filter_map(|demo| demo.action_error.largest.get(i)).fold(0.0, |a, b| f64::max(a, *b))
        };
        let channels = plan.interface.get("action").and_then(serde_json::Value::as_array);
        let text = |channel: &serde_json::Value, field: &str| {
            channel.get(field).and_then(serde_json::Value::as_str).unwrap_or_default().to_owned()
        };
        let channel_error = |(i, channel): (usize, &serde_json::Value)| ChannelError {
            channel: text(channel, "name"),
            unit: text(channel, "unit"),
            mean: weighted(&|error| &error.mean, i),
            largest: largest(i),
            saturated: weighted(&|error| &error.saturated, i),
        };
        Self {
            controller: plan.scenario.names().controller.clone(),
            via: plan.via,
            trees: trees.len() as u32,
            never_began: records.iter().filter(|record| record.never_began.is_some()).count() as u32,
            action_error: channels.into_iter().flatten().enumerate().map(channel_error).collect(),
            all,
            splits,
            outcomes,
        }
    }
}
