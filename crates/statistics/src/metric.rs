//! Metrics: ratios of sums over trees, each with its interval.

use std::borrow::Borrow;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::bootstrap::{Resamples, Share, ratio};
use crate::components::{VarianceComponents, variance_components};
use crate::design::Design;
use crate::undefined::Undefined;

/// A metric: its name, its unit and one tree's share of it.
pub struct MetricDefinition<R> {
    /// Name in `summary.json`.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// One tree's numerator and denominator.
    pub share: fn(&R) -> Share,
}

/// A metric's estimate. Without anything to measure, all is null and `n` is 0; with one tree, the interval is null.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Metric {
    /// Ratio of sums.
    pub mean: Option<f64>,
    /// 95 % bootstrap interval over trees x seeds.
    pub ci95: [Option<f64>; 2],
    /// Sum of the denominators: trees, attempts, detections or visible fruit.
    pub n: u64,
    /// Reason why the interval is null, if so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub undefined: Option<Undefined>,
}

impl Metric {
    /// The ratio of the sums of trees' shares; `resamples` index into them.
    pub fn of(shares: &[Share], resamples: &Resamples) -> Self {
        let interval = resamples.interval(shares);
        Self {
            mean: ratio(shares.iter().copied()).filter(|mean| mean.is_finite()),
            ci95: interval_ends(interval.ok()),
            n: shares.iter().map(|s| s.denominator).sum::<f64>() as u64,
            undefined: interval.err(),
        }
    }
}

/// The variance components of every metric of a list. An episode's value is its own numerator over its own denominator.
pub fn components_of_metrics<R, B: Borrow<R>>(
    definitions: &[MetricDefinition<R>],
    records: &[B],
    design: &Design,
) -> BTreeMap<String, VarianceComponents> {
    let value = |share: Share| ratio(std::iter::once(share));
    definitions
        .iter()
        .map(|definition| {
            let values: Vec<Option<f64>> =
                records.iter().map(|record| value((definition.share)(record.borrow()))).collect();
            (definition.name.to_owned(), variance_components(design, &values))
        })
        .collect()
}

/// Returns the ends of an interval, each null without one, as result files hold them.
pub fn interval_ends(interval: Option<[f64; 2]>) -> [Option<f64>; 2] {
    interval.map_or([None, None], |ends| ends.map(Some))
}

/// Every metric of a list over trees' records; `resamples` index into them.
pub fn estimate<R, B: Borrow<R>>(
    definitions: &[MetricDefinition<R>],
    records: &[B],
    resamples: &Resamples,
) -> BTreeMap<String, Metric> {
    definitions
        .iter()
        .map(|definition| {
            let shares: Vec<Share> =
                records.iter().map(|record| (definition.share)(record.borrow())).collect();
            (definition.name.to_owned(), Metric::of(&shares, resamples))
        })
        .collect()
}
