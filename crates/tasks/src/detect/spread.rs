//! Quantiles of errors, pooled over the true positives of all trees.

use std::collections::BTreeMap;

use orchard_statistics::Resamples;
use orchard_statistics::metric::interval_ends;
use orchard_statistics::quantile::quantile;
use serde::{Deserialize, Serialize};

use crate::detect::tally::Tally;

/// A quantile with its interval. Without a true positive all fields are null and `n` is 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The quantile.
    pub value: Option<f64>,
    /// 95 % bootstrap interval over trees x seeds.
    pub ci95: [Option<f64>; 2],
    /// Errors.
    pub n: u64,
}

/// Definition of a quantile of errors.
pub struct ErrorDefinition {
    /// Name in `detect.json`.
    pub name: &'static str,
    /// Level of the quantile, 0 to 1.
    pub quantile: f64,
    /// A tree's errors \[m\].
    pub errors: fn(&Tally) -> Vec<f64>,
}

/// All quantiles of one foliage density or variant.
pub const ERRORS: &[ErrorDefinition] = &[
    ErrorDefinition { name: "centre_error_median_m", quantile: 0.5, errors: |t| t.centre_errors.clone() },
    ErrorDefinition { name: "centre_error_p95_m", quantile: 0.95, errors: |t| t.centre_errors.clone() },
    ErrorDefinition {
        name: "radius_error_median_m",
        quantile: 0.5,
        errors: |t| t.radius_errors.iter().map(|e| e.abs()).collect(),
    },
];

/// Every quantile; `resamples` index into the trees.
pub(crate) fn spreads(trees: &[Tally], resamples: &Resamples) -> BTreeMap<String, Spread> {
    ERRORS
        .iter()
        .map(|definition| (definition.name.to_owned(), spread(definition, trees, resamples)))
        .collect()
}

fn spread(definition: &ErrorDefinition, trees: &[Tally], resamples: &Resamples) -> Spread {
    // Sorted once, each with its tree: a resample only changes how often a tree's errors count.
    let mut errors: Vec<(f64, usize)> = Vec::new();
    for (tree, tally) in trees.iter().enumerate() {
        errors.extend((definition.errors)(tally).into_iter().map(|error| (error, tree)));
    }
    errors.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let of_trees = |drawn: &[usize]| {
        let mut times = vec![0_usize; trees.len()];
        drawn.iter().for_each(|&tree| times[tree] += 1);
        let pooled: Vec<f64> =
            errors.iter().flat_map(|&(error, tree)| std::iter::repeat_n(error, times[tree])).collect();
        quantile(&pooled, definition.quantile)
    };
    let all: Vec<usize> = (0..trees.len()).collect();
    Spread {
        value: of_trees(&all),
        ci95: interval_ends(resamples.interval_of(of_trees).ok()),
        n: errors.len() as u64,
    }
}
