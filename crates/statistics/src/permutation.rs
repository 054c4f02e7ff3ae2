//! The paired permutation test (Fisher 1935): under the null hypothesis either side of a pair could have
//! been the other, so that every change of signs of the differences was as likely. Two-sided, on the mean difference.

use orchard_spec::{Purpose, Stream};
use serde::{Deserialize, Serialize};

use crate::rules::PairedRules;
use crate::undefined::Undefined;
use crate::wilcoxon::Method;

/// Outcome of the test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Permutation {
    /// Mean difference.
    pub statistic: f64,
    /// Two-sided p-value.
    pub p_value: f64,
    /// Method of the p-value.
    pub method: Method,
    /// Number of sign patterns that were evaluated.
    pub patterns: u64,
    /// Pairs.
    pub n: usize,
}

/// Sums that are equal but for rounding count as equal: relative to the sum of all sizes, far above the rounding of a sum of a few
/// thousand terms (n times 2^-53) and far below any difference that matters.
const ROUNDING: f64 = 1e-12;

/// Largest number of pairs that is enumerated, whatever the rules.
const ENUMERABLE: usize = 30;

/// Tests whether the mean difference is 0. Up to `rules.permutation_exact` differences that are not 0 every sign pattern is tried; else
/// random ones, and the sample itself counts as one of them (Phipson and Smyth 2010), so that p is never 0.
///
/// # Errors
/// No pair, all differences 0, one not finite.
pub fn permutation(differences: &[f64], rules: &PairedRules) -> Result<Permutation, Undefined> {
    if differences.is_empty() {
        return Err(Undefined::NoPairs);
    }
    if differences.iter().any(|d| !d.is_finite()) {
        return Err(Undefined::NotFinite);
    }
    // A zero has no sign to change: without it every pattern's sum is the same.
    let changing: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0).collect();
    if changing.is_empty() {
        return Err(Undefined::AllZero);
    }
    let sum: f64 = changing.iter().sum();
    let least = sum.abs() - ROUNDING * changing.iter().map(|d| d.abs()).sum::<f64>();
    let (p_value, method, patterns) =
        if changing.len() <= (rules.permutation_exact.get() as usize).min(ENUMERABLE) {
            let patterns = 1_u64 << changing.len();
            (as_large(&changing, 0.0, least) as f64 / patterns as f64, Method::Exact, patterns)
        } else {
            let patterns = u64::from(rules.permutations.get());
            let as_large = sampled(&changing, least, rules);
            ((as_large + 1) as f64 / (patterns + 1) as f64, Method::Sampled, patterns)
        };
    let n = differences.len();
    Ok(Permutation { statistic: sum / n as f64, p_value, method, patterns, n })
}

/// Sign patterns of `rest` that, with `sum` before, are at least as large as `least`.
fn as_large(rest: &[f64], sum: f64, least: f64) -> u64 {
    match rest {
        [] => u64::from(sum.abs() >= least),
        [first, rest @ ..] => as_large(rest, sum + first, least) + as_large(rest, sum - first, least),
    }
}

fn sampled(differences: &[f64], least: f64, rules: &PairedRules) -> u64 {
    let mut stream = Stream::new(u64::from(rules.seed.get()), 0, Purpose::Permutation);
    let mut sum = || -> f64 { differences.iter().map(|d| if stream.chance(0.5) { *d } else { -d }).sum() };
    (0..rules.permutations.get()).filter(|_| sum().abs() >= least).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_rules::paired;

    fn rules() -> PairedRules {
        paired()
    }

    /// Differences 1, 2, 4: the eight sums are all odd numbers from -7 to 7, once each.
    #[test]
    fn exact_by_hand() {
        let test = permutation(&[1.0, 2.0, 4.0, 0.0], &rules()).unwrap();
        assert_eq!((test.statistic, test.p_value, test.method), (7.0 / 4.0, 2.0 / 8.0, Method::Exact));
        assert_eq!(permutation(&[1.0, -2.0, 4.0], &rules()).unwrap().p_value, 6.0 / 8.0);
        assert_eq!(permutation(&[3.0, -3.0], &rules()).unwrap().p_value, 1.0);
    }

    /// Sums of 0.1 and its like tie in the reals, not in f64.
    #[test]
    fn rounding_breaks_no_ties() {
        let test = permutation(&[0.1, 0.2, -0.3, 0.7], &rules()).unwrap();
        // |sum| = 0.7; patterns of the first three sum to 0 (twice), +-0.2, +-0.4, +-0.6; with +-0.7 added at least 0.7 in size:
        // for each sign of 0.7 the two zeros and the three of its own sign.
        assert_eq!(test.p_value, 10.0 / 16.0);
    }

    #[test]
    fn a_sample_of_patterns_is_near_the_whole() {
        let differences: Vec<f64> = (0..14).map(|i| f64::from(i) - 4.0).collect();
        let exact = permutation(&differences, &rules()).unwrap();
        let few =
            PairedRules { permutation_exact: rules().permutation_exact.with_value(2).unwrap(), ..rules() };
        let sampled = permutation(&differences, &few).unwrap();
        assert_eq!((exact.method, sampled.method), (Method::Exact, Method::Sampled));
        let error = (exact.p_value * (1.0 - exact.p_value) / sampled.patterns as f64).sqrt();
        assert!((exact.p_value - sampled.p_value).abs() < 5.0 * error, "{exact:?} {sampled:?}");
        assert_eq!(permutation(&differences, &few).unwrap(), sampled);
        // Never 0.
        let clear: Vec<f64> = (1..=40).map(f64::from).collect();
        let test = permutation(&clear, &rules()).unwrap();
        assert_eq!(test.p_value, 1.0 / (test.patterns + 1) as f64);
    }

    #[test]
    fn degenerate_samples_have_reasons() {
        assert_eq!(permutation(&[], &rules()), Err(Undefined::NoPairs));
        assert_eq!(permutation(&[0.0], &rules()), Err(Undefined::AllZero));
        assert_eq!(permutation(&[f64::INFINITY], &rules()), Err(Undefined::NotFinite));
    }
}
