//! Quantiles of errors, pooled over the true positives of all trees.

use std::collections::BTreeMap;

use orchard_statistics::metric::interval_ends;
use orchard_statistics::{Metric, Resamples};
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
    let errors: Vec<Vec<f64>> = trees.iter().map(definition.errors).collect();
    let Metric { mean: value, ci95, n, .. } = Metric::of_quantile(&errors, definition.quantile, resamples);
    Spread { value, ci95, n }
}

/// Sums of the pairs (x, y) of one tree, from which a correlation follows: n, x, y, x x, y y, x y.
type Sums = [f64; 6];

/// Pearson's correlation between detected and true radii of true positives: 0 for a detector that guesses one radius for all. Null if all
/// radii of one kind are equal.
pub(crate) fn radius_correlation(trees: &[Tally], resamples: &Resamples) -> Spread {
    let sums: Vec<Sums> = trees
        .iter()
        .map(|tally| {
            tally.radii.iter().fold([0.0; 6], |s, &[x, y]| plus(&s, &[1.0, x, y, x * x, y * y, x * y]))
        })
        .collect();
    let of_trees =
        |drawn: &[usize]| correlation(&drawn.iter().fold([0.0; 6], |sum, &tree| plus(&sum, &sums[tree])));
    let all: Vec<usize> = (0..trees.len()).collect();
    Spread {
        value: of_trees(&all),
        ci95: interval_ends(resamples.interval_of(of_trees).ok()),
        n: trees.iter().map(|tally| tally.radii.len() as u64).sum(),
    }
}

fn plus(a: &Sums, b: &Sums) -> Sums {
    std::array::from_fn(|k| a[k] + b[k])
}

fn correlation(&[n, x, y, xx, yy, xy]: &Sums) -> Option<f64> {
    // Radii of centimetres that differ by less than a nanometre are equal.
    const LEAST_VARIANCE: f64 = 1e-18;
    let (var_x, var_y) = (xx / n - x * x / n / n, yy / n - y * y / n / n);
    let defined = n > 1.0 && var_x > LEAST_VARIANCE && var_y > LEAST_VARIANCE;
    defined.then(|| (xy / n - x * y / n / n) / (var_x * var_y).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlation_by_hand() {
        let of = |pairs: &[[f64; 2]]| {
            correlation(
                &pairs.iter().fold([0.0; 6], |s, &[x, y]| plus(&s, &[1.0, x, y, x * x, y * y, x * y])),
            )
        };
        let near = |a: Option<f64>, b: f64| (a.unwrap() - b).abs() < 1e-9;
        assert!(near(of(&[[0.03, 0.04], [0.04, 0.05], [0.05, 0.06]]), 1.0));
        assert!(near(of(&[[0.03, 0.06], [0.04, 0.05], [0.05, 0.04]]), -1.0));
        // Deviations (-1, 0, 1) and (1, -2, 1): no correlation.
        assert!(near(of(&[[0.03, 0.05], [0.04, 0.02], [0.05, 0.05]]), 0.0));
        assert_eq!(of(&[[0.03, 0.04], [0.03, 0.05]]), None);
        assert_eq!(of(&[[0.03, 0.04]]), None);
        assert_eq!(of(&[]), None);
    }
}
