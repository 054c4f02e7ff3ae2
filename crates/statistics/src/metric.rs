//! Metrics: ratios of sums over trees, each with its interval.

use std::borrow::Borrow;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::bootstrap::{Resamples, Share, ratio};
use crate::components::{VarianceComponents, variance_components};
use crate::design::Design;
use crate::quantile::quantile;
use crate::undefined::Undefined;

/// Name, unit and definition of a metric. Results, reports and documentation all take them from here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MetricInfo {
    /// Name in `summary.json`.
    pub name: &'static str,
    /// Title in reports.
    pub title: &'static str,
    /// Unit; `1` for a ratio of equal units.
    pub unit: &'static str,
    /// Numerator of one tree.
    pub numerator: &'static str,
    /// Denominator of one tree; `1` for a mean over trees.
    pub denominator: &'static str,
    /// Edge cases and remarks; empty if there are none.
    pub note: &'static str,
}

impl MetricInfo {
    /// Returns the definition as a sentence: the numerator over the denominator, and the note.
    pub fn definition(&self) -> String {
        let Self { numerator, denominator, note, .. } = self;
        let ratio = match *denominator {
            "1" => format!("{numerator}; mean over trees"),
            of => format!("{numerator}, divided by {of}"),
        };
        let mut letters = ratio.chars();
        let ratio =
            letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect());
        if note.is_empty() { format!("{ratio}.") } else { format!("{ratio}. {note}.") }
    }

    /// Returns the rows of a Markdown table, heads included, with a line for each metric.
    pub fn markdown(infos: &[Self]) -> String {
        let row = |info: &Self| {
            let Self { name, title, unit, numerator, denominator, note } = info;
            format!("| `{name}` | {title} | {unit} | {numerator} | {denominator} | {note} |\n")
        };
        "| name | title | unit | a_i | b_i | note |\n|---|---|---|---|---|---|\n".to_owned()
            + &infos.iter().map(row).collect::<String>()
    }
}

/// A metric: its definition in words and one tree's share of it.
pub struct MetricDefinition<R> {
    /// Name, unit and definition.
    pub info: MetricInfo,
    /// One tree's numerator and denominator.
    pub share: fn(&R) -> Share,
}

/// A metric that is a quantile of single values, pooled over trees.
pub struct QuantileDefinition<R> {
    /// Name, unit and definition; the numerator names the values.
    pub info: MetricInfo,
    /// Level of the quantile, 0 to 1.
    pub level: f64,
    /// One tree's values.
    pub values: fn(&R) -> Vec<f64>,
}

/// A metric's estimate. Without anything to measure, all is null and `n` is 0; with one tree, the interval is null.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Metric {
    /// Ratio of sums, or quantile.
    pub mean: Option<f64>,
    /// 95 % bootstrap interval over trees x seeds.
    pub ci95: [Option<f64>; 2],
    /// Sum of the denominators: trees, attempts, detections or visible fruit; number of values of a quantile.
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

impl Metric {
    /// A quantile of the values of all trees together, by tree; `resamples` index into the trees.
    pub fn of_quantile(values: &[Vec<f64>], level: f64, resamples: &Resamples) -> Self {
        // Sorted once, each with its tree: a resample only changes how often a tree's values count.
        let mut sorted: Vec<(f64, usize)> = Vec::new();
        for (tree, values) in values.iter().enumerate() {
            sorted.extend(values.iter().map(|&value| (value, tree)));
        }
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let of_trees = |drawn: &[usize]| {
            let mut times = vec![0_usize; values.len()];
            drawn.iter().for_each(|&tree| times[tree] += 1);
            let pooled: Vec<f64> =
                sorted.iter().flat_map(|&(value, tree)| std::iter::repeat_n(value, times[tree])).collect();
            quantile(&pooled, level)
        };
        let all: Vec<usize> = (0..values.len()).collect();
        let interval = resamples.interval_of(of_trees);
        Self {
            mean: of_trees(&all),
            ci95: interval_ends(interval.as_ref().ok().copied()),
            n: sorted.len() as u64,
            undefined: interval.err(),
        }
    }
}

/// Every quantile of a list over trees' records; `resamples` index into them.
pub fn estimate_quantiles<R, B: Borrow<R>>(
    definitions: &[QuantileDefinition<R>],
    records: &[B],
    resamples: &Resamples,
) -> BTreeMap<String, Metric> {
    let of = |definition: &QuantileDefinition<R>| {
        let values: Vec<Vec<f64>> =
            records.iter().map(|record| (definition.values)(record.borrow())).collect();
        (definition.info.name.to_owned(), Metric::of_quantile(&values, definition.level, resamples))
    };
    definitions.iter().map(of).collect()
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
            (definition.info.name.to_owned(), variance_components(design, &values))
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
            (definition.info.name.to_owned(), Metric::of(&shares, resamples))
        })
        .collect()
}
