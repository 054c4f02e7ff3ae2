//! Results of a result folder: every part that is present.

use orchard_bench::compute::Compute;
use orchard_scaling::Scaling;
use orchard_statistics::Metric;
use orchard_tasks::component::ComponentSummary;
use orchard_tasks::detect::DetectSummary;
use orchard_tasks::harvest::matrix::{EXHAUSTION, NOMINAL};
use orchard_tasks::harvest::summary::{ConditionSummary, Summary};

/// Results; a part is empty if its task was not run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Results {
    /// The harvest, `summary.json`.
    pub harvest: Option<Summary>,
    /// Detection, `detect.json`.
    pub detect: Option<DetectSummary>,
    /// The component tasks, `reach-and-grasp.json` and `gentle.json`, in this order.
    pub components: Vec<ComponentSummary>,
    /// Compute cost of the harvest task, `compute.json`.
    pub compute: Option<Compute>,
    /// Throughput over parallel worlds, `scaling.json` and `scaling-gpu.json`: one per backend.
    pub scaling: Vec<Scaling>,
}

impl Results {
    /// True if there are no results.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The nominal condition, or the first condition if it was not run.
pub fn main_condition(summary: &Summary) -> Option<(&str, &ConditionSummary)> {
    let conditions = &summary.conditions;
    let main = conditions.get_key_value(NOMINAL).or_else(|| conditions.first_key_value());
    main.map(|(name, results)| (name.as_str(), results))
}

/// All conditions, the nominal one first, then by name.
pub(crate) fn conditions(summary: &Summary) -> Vec<(&str, &ConditionSummary)> {
    let mut all: Vec<_> = summary.conditions.iter().map(|(name, c)| (name.as_str(), c)).collect();
    all.sort_by_key(|(name, _)| *name != NOMINAL);
    all
}

/// Conditions reported in full: the nominal one and its exhaustion; if there are none, every condition.
pub(crate) fn principal(summary: &Summary) -> Vec<(&str, &ConditionSummary)> {
    let all = conditions(summary);
    let main: Vec<_> = all.iter().copied().filter(|(name, _)| [NOMINAL, EXHAUSTION].contains(name)).collect();
    if main.is_empty() { all } else { main }
}

/// True if conditions other than those in full are outside all sweeps.
pub(crate) fn has_singles(summary: &Summary) -> bool {
    let swept = |name: &str| {
        let mut points = summary.sweeps.values().flat_map(|sweep| &sweep.points);
        points.any(|point| point.condition == name)
    };
    summary.conditions.keys().any(|name| ![NOMINAL, EXHAUSTION].contains(&name.as_str()) && !swept(name))
}

/// A metric under a condition.
pub(crate) fn metric_of<'a>(summary: &'a Summary, condition: &str, metric: &str) -> Option<&'a Metric> {
    summary.conditions.get(condition)?.metrics.get(metric)
}

/// Both ends of an interval, if there is one.
pub(crate) fn ends(ci95: [Option<f64>; 2]) -> Option<[f64; 2]> {
    match ci95 {
        [Some(low), Some(high)] => Some([low, high]),
        _ => None,
    }
}
