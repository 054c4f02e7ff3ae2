//! The Wilcoxon signed-rank test (Wilcoxon 1945; Hollander, Wolfe and Chicken 2014, section 3.1), two-sided.

use orchard_geometry::math;
use serde::{Deserialize, Serialize};

use crate::ranks::SignedRanks;
use crate::undefined::Undefined;

/// Method by which a p-value was computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The whole distribution under the null hypothesis.
    Exact,
    /// The normal approximation.
    Normal,
    /// A random sample of the distribution.
    Sampled,
}

/// Outcome of the test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Wilcoxon {
    /// The smaller of the two rank sums.
    pub statistic: f64,
    /// Two-sided p-value.
    pub p_value: f64,
    /// Method of the p-value.
    pub method: Method,
    /// Pairs that differ.
    pub n: usize,
}

/// Most pairs whose 2^n sign patterns an f64 counts without rounding.
const COUNTABLE: usize = 52;

/// Tests whether differences lie symmetrically about 0. Zeros are left out. Up to `exact` differences without ties the p-value is
/// exact; else it is that of the normal approximation with tie and continuity correction (scipy's `wilcox`, `correction=True`).
///
/// # Errors
/// No pair, all differences 0, one not finite.
pub fn wilcoxon(differences: &[f64], exact: usize) -> Result<Wilcoxon, Undefined> {
    if differences.is_empty() {
        return Err(Undefined::NoPairs);
    }
    if differences.iter().any(|d| !d.is_finite()) {
        return Err(Undefined::NotFinite);
    }
    let ranks = SignedRanks::of(differences);
    if ranks.n == 0 {
        return Err(Undefined::AllZero);
    }
    let statistic = ranks.positive.min(ranks.negative);
    let (p_value, method) = if ranks.ties.is_empty() && ranks.n <= exact.min(COUNTABLE) {
        (exact_p(ranks.n, statistic), Method::Exact)
    } else {
        (normal_p(&ranks, statistic), Method::Normal)
    };
    Ok(Wilcoxon { statistic, p_value, method, n: ranks.n })
}

/// Twice the chance that a sum of ranks 1 to n with random signs is as small as this.
fn exact_p(n: usize, statistic: f64) -> f64 {
    // patterns[s]: how many subsets of the ranks so far have the sum s; whole numbers below 2^53.
    let mut patterns = vec![0.0; n * (n + 1) / 2 + 1];
    patterns[0] = 1.0;
    for rank in 1..=n {
        for sum in (rank..patterns.len()).rev() {
            patterns[sum] += patterns[sum - rank];
        }
    }
    let below: f64 = patterns.iter().take(statistic as usize + 1).sum();
    let all: f64 = patterns.iter().sum();
    (2.0 * below / all).min(1.0)
}

fn normal_p(ranks: &SignedRanks, statistic: f64) -> f64 {
    let n = ranks.n as f64;
    let mean = n * (n + 1.0) / 4.0;
    let tied: f64 = ranks.ties.iter().map(|&t| t as f64 * (t as f64 * t as f64 - 1.0)).sum();
    let variance = (n * (n + 1.0) * (2.0 * n + 1.0) - 0.5 * tied) / 24.0;
    // The statistic is at most the mean: the continuity correction brings it half a step nearer.
    let z = (mean - statistic - 0.5).max(0.0) / variance.sqrt();
    math::erfc(z * std::f64::consts::FRAC_1_SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counted by hand: of the 2^5 sign patterns of the ranks 1 to 5 three have a negative sum of at most 2 ({}, {1}, {2}).
    #[test]
    fn exact_by_hand() {
        let test = wilcoxon(&[1.0, -2.0, 3.0, 4.0, 5.0], 50).unwrap();
        assert_eq!(test, Wilcoxon { statistic: 2.0, p_value: 2.0 * 3.0 / 32.0, method: Method::Exact, n: 5 });
        // Zeros are left out; a single difference is never significant.
        assert_eq!(wilcoxon(&[0.0, 0.3], 50).unwrap().p_value, 1.0);
        assert_eq!(wilcoxon(&[1.0, 2.0, -3.0], 50).unwrap().p_value, 1.0);
    }

    /// Every sign pattern of 50 ranks: no count is rounded, and the smallest p-value is 2 / 2^50.
    #[test]
    fn exact_up_to_fifty() {
        let all: Vec<f64> = (1..=50).map(f64::from).collect();
        assert_eq!(wilcoxon(&all, 50).unwrap().p_value, (-49.0_f64).exp2());
        assert_eq!(wilcoxon(&all, 49).unwrap().method, Method::Normal);
    }

    #[test]
    fn ties_take_the_normal_approximation() {
        // n = 4, ranks 2.5 each: W = 2.5, mean 5, variance (4 5 9 - 60 / 2) / 24 = 6.25: z = 2 / 2.5.
        let test = wilcoxon(&[1.0, 1.0, 1.0, -1.0], 50).unwrap();
        assert_eq!((test.statistic, test.method), (2.5, Method::Normal));
        assert!((test.p_value - 0.423_710_797_1).abs() < 1e-9, "{}", test.p_value);
        // At the mean the p-value is 1: the continuity correction does not overshoot.
        assert_eq!(wilcoxon(&[1.0, -1.0], 50).unwrap().p_value, 1.0);
    }

    #[test]
    fn degenerate_samples_have_reasons() {
        assert_eq!(wilcoxon(&[], 50), Err(Undefined::NoPairs));
        assert_eq!(wilcoxon(&[0.0, 0.0], 50), Err(Undefined::AllZero));
        assert_eq!(wilcoxon(&[1.0, f64::NAN], 50), Err(Undefined::NotFinite));
    }
}
