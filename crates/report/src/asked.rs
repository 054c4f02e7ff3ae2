//! Requirements on a controller over the tuning seeds, and the check that a result meets them.

use orchard_scenario::SceneNames;
use orchard_tasks::harvest::matrix::EXHAUSTION;
use orchard_tasks::harvest::plan::ConditionParams;
use orchard_tasks::harvest::summary::{ConditionSummary, Summary};
use orchard_tasks::protocol::{Protocol, Requirement};

use crate::results::conditions;

/// Requirements under one condition, with their verdicts.
#[derive(Debug, Clone, PartialEq)]
pub struct Demands<'a> {
    /// The condition.
    pub condition: &'a str,
    /// Verdicts by metric; none where the result cannot be judged: other seeds, trees, repeats or time than required.
    pub judged: Option<Vec<Judged<'a>>>,
}

/// One requirement with its measured value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged<'a> {
    /// The metric.
    pub metric: &'a str,
    /// Requirement.
    pub asked: &'a Requirement,
    /// Measured mean; none where it is undefined.
    pub mean: Option<f64>,
}

impl Judged<'_> {
    /// True if the mean meets the requirement.
    pub fn is_met(&self) -> bool {
        self.asked.is_met(self.mean)
    }
}

/// Judges every condition of a result that has requirements, the nominal one first.
pub fn demands<'a>(summary: &'a Summary, protocol: &'a Protocol) -> Vec<Demands<'a>> {
    let Some(asked) = protocol.asked.get(&summary.controller) else { return Vec::new() };
    let judge = |(condition, results): (&'a str, &'a ConditionSummary)| {
        let figures = asked.get(condition)?;
        let judged = as_asked(summary, &results.params, condition, protocol).then(|| {
            let judged = |(metric, asked): (&'a String, &'a Requirement)| Judged {
                metric,
                asked,
                mean: results.metrics.get(metric).and_then(|metric| metric.mean),
            };
            figures.iter().map(judged).collect()
        });
        Some(Demands { condition, judged })
    };
    conditions(summary).into_iter().filter_map(judge).collect()
}

/// True if a result is on what figures are asked of: the benchmark's own scene, the tuning seeds, the full profile's trees and time, each
/// tree once.
fn as_asked(summary: &Summary, params: &ConditionParams, condition: &str, protocol: &Protocol) -> bool {
    let horizon = match condition {
        EXHAUSTION => protocol.exhaustion.horizon.si(),
        _ => protocol.full.horizon.si(),
    };
    summary.scenario.names.scene == SceneNames::paper()
        && summary.seeds == protocol.tuning_seeds
        && params.trees == protocol.full.trees.get()
        && params.repeats == 1
        && params.horizon_s == horizon
}
