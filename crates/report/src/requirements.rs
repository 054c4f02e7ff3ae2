//! Requirements on a controller over the tuning seeds, and the check that a result meets them.

use orchard_scenario::SceneNames;
use orchard_tasks::harvest::matrix::is_exhaustion;
use orchard_tasks::harvest::plan::ConditionParams;
use orchard_tasks::harvest::summary::{ConditionSummary, Summary};
use orchard_tasks::protocol::{Protocol, Requirement};

use crate::results::conditions;

/// Requirements under one condition, with their verdicts.
#[derive(Debug, Clone, PartialEq)]
pub struct ConditionRequirements<'a> {
    /// The condition.
    pub condition: &'a str,
    /// Verdicts by metric; none where the result cannot be judged: other seeds, trees, repeats or time than required.
    pub judged: Option<Vec<JudgedRequirement<'a>>>,
}

/// One requirement with its measured value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JudgedRequirement<'a> {
    /// The metric.
    pub metric: &'a str,
    /// Requirement.
    pub requirement: &'a Requirement,
    /// Measured mean; none where it is undefined.
    pub mean: Option<f64>,
}

impl JudgedRequirement<'_> {
    /// True if the mean meets the requirement.
    pub fn is_met(&self) -> bool {
        self.requirement.is_met(self.mean)
    }
}

/// Judges every condition of a result that has requirements, the nominal one first.
pub fn judge_requirements<'a>(
    summary: &'a Summary,
    protocol: &'a Protocol,
) -> Vec<ConditionRequirements<'a>> {
    let Some(required) = protocol.required.get(&summary.controller) else { return Vec::new() };
    let judge = |(condition, results): (&'a str, &'a ConditionSummary)| {
        let required = required.get(condition)?;
        let judged = is_comparable(summary, &results.params, condition, protocol).then(|| {
            let judged = |(metric, requirement): (&'a String, &'a Requirement)| JudgedRequirement {
                metric,
                requirement,
                mean: results.metrics.get(metric).and_then(|metric| metric.mean),
            };
            required.iter().map(judged).collect()
        });
        Some(ConditionRequirements { condition, judged })
    };
    conditions(summary).into_iter().filter_map(judge).collect()
}

/// True if the requirements apply to a result: the benchmark's own scene, the tuning seeds, the full profile's trees and time, one
/// episode per tree.
fn is_comparable(summary: &Summary, params: &ConditionParams, condition: &str, protocol: &Protocol) -> bool {
    let horizon = match condition {
        name if is_exhaustion(name) => protocol.exhaustion.horizon.si(),
        _ => protocol.full.horizon.si(),
    };
    summary.scenario.names.scene == SceneNames::paper()
        && summary.seeds == protocol.tuning_seeds
        && params.trees == protocol.full.trees.get()
        && params.repeats == 1
        && params.horizon_s == horizon
}
