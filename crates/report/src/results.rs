//! What a result folder holds, as far as it holds it.

use std::collections::BTreeMap;

use orchard_bench::component::ComponentSummary;
use orchard_bench::compute::Compute;
use orchard_bench::detect::DetectSummary;
use orchard_bench::metrics::Metric;
use orchard_bench::statistics::Comparison;
use orchard_bench::summary::{ConditionSummary, Summary};
use serde::{Deserialize, Serialize};

/// Results, each where its task was run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Results {
    /// The harvest, `summary.json`.
    pub harvest: Option<Harvest>,
    /// Detection, `detect.json`.
    pub detect: Option<DetectSummary>,
    /// The component tasks, `reach-and-grasp.json` and `gentle.json`, in this order.
    pub components: Vec<ComponentSummary>,
    /// What the harvest cost, `compute.json`.
    pub compute: Option<Compute>,
    /// Throughput over parallel worlds, `scaling.json`.
    pub scaling: Option<Scaling>,
}

/// The harvest's results.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Harvest {
    /// The summary.
    #[serde(flatten)]
    pub summary: Summary,
    /// Worlds that were quarantined, over all conditions.
    #[serde(default)]
    pub quarantined: u32,
    /// Sweeps of one dial by name.
    #[serde(default)]
    pub sweeps: BTreeMap<String, Sweep>,
}

/// The same trees at several places of one dial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// The dial.
    pub dial: String,
    /// Its unit.
    pub unit: String,
    /// The conditions, in the order of the dial.
    pub points: Vec<SweepPoint>,
    /// Paired tests.
    pub comparisons: Vec<SweepComparison>,
}

/// A condition of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepPoint {
    /// The condition.
    pub condition: String,
    /// Where the dial stands.
    pub value: f64,
}

/// A paired test of a metric under two conditions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepComparison {
    /// The metric.
    pub metric: String,
    /// The condition that is compared with.
    pub reference: String,
    /// The other one.
    pub condition: String,
    /// The tests.
    pub test: Comparison,
    /// Their p-values, adjusted after Holm over the sweep.
    pub holm: Adjusted,
}

/// Adjusted p-values; null where a test is undefined.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Adjusted {
    /// Of the signed-rank test.
    pub wilcoxon: Option<f64>,
    /// Of the permutation test.
    pub permutation: Option<f64>,
}

/// Throughput over parallel worlds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scaling {
    /// Layout version.
    pub schema_version: u32,
    /// The machine.
    pub machine: orchard_bench::compute::Machine,
    /// Threads.
    pub threads: u32,
    /// A row a number of worlds, solver and mode.
    pub rows: Vec<ScalingRow>,
}

/// One number of worlds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScalingRow {
    /// Solver.
    pub solver: String,
    /// Randomisation mode.
    pub mode: String,
    /// Worlds.
    pub worlds: u32,
    /// Frames of the whole batch a second.
    pub step_rate_per_s: f64,
    /// Frames of one world a second, all worlds together.
    pub env_steps_per_s: f64,
    /// Memory [MiB].
    pub memory_mib: Option<f64>,
}

impl Results {
    /// Whether there is nothing at all.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The condition that most results are told of.
const NOMINAL: &str = "nominal";

impl Harvest {
    /// The nominal condition, or the first where it was not run.
    pub fn main(&self) -> Option<(&str, &ConditionSummary)> {
        let conditions = &self.summary.conditions;
        let main = conditions.get_key_value(NOMINAL).or_else(|| conditions.first_key_value());
        main.map(|(name, results)| (name.as_str(), results))
    }

    /// All conditions, the nominal one first, then by name.
    pub fn conditions(&self) -> Vec<(&str, &ConditionSummary)> {
        let mut all: Vec<_> = self.summary.conditions.iter().map(|(name, c)| (name.as_str(), c)).collect();
        all.sort_by_key(|(name, _)| *name != NOMINAL);
        all
    }

    /// Conditions that no sweep has, and the nominal one.
    pub fn apart_from_sweeps(&self) -> Vec<(&str, &ConditionSummary)> {
        let swept = |name: &str| {
            let mut points = self.sweeps.values().flat_map(|sweep| &sweep.points);
            name != NOMINAL && points.any(|point| point.condition == name)
        };
        self.conditions().into_iter().filter(|(name, _)| !swept(name)).collect()
    }

    /// A metric under a condition.
    pub fn metric(&self, condition: &str, metric: &str) -> Option<&Metric> {
        self.summary.conditions.get(condition)?.metrics.get(metric)
    }
}

/// Both ends of an interval, if there is one.
pub(crate) fn ends(ci95: [Option<f64>; 2]) -> Option<[f64; 2]> {
    match ci95 {
        [Some(low), Some(high)] => Some([low, high]),
        _ => None,
    }
}
