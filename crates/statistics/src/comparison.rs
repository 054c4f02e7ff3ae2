//! Two conditions on the same trees.

use serde::{Deserialize, Serialize};

use crate::bootstrap::{Resamples, Share};
use crate::design::Design;
use crate::effect::{cohens_dz, rank_biserial};
use crate::permutation::{Permutation, permutation};
use crate::rules::{BootstrapRules, PairedRules};
use crate::undefined::{Figure, Undefined};
use crate::wilcoxon::{Wilcoxon, wilcoxon};

/// Paired comparison of a metric between two conditions, by tree. A tree's value is its own ratio of sums over its repeats; a tree for
/// which the metric is undefined under one of the two is left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Trees with a value under both conditions.
    pub pairs: u32,
    /// Of these, with equal values.
    pub equal: u32,
    /// Mean difference, second less first.
    pub mean: Figure,
    /// 95 % bootstrap interval over trees x seeds.
    pub ci95: [Option<f64>; 2],
    /// Reason why there is no interval, if so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_interval: Option<Undefined>,
    /// Wilcoxon signed-rank test; null where it is undefined.
    pub wilcoxon: Option<Wilcoxon>,
    /// Paired permutation test; null where it is undefined.
    pub permutation: Option<Permutation>,
    /// Reason why there are no tests, if so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_test: Option<Undefined>,
    /// Matched-pairs rank-biserial correlation.
    pub rank_biserial: Figure,
    /// Cohen's d_z.
    pub cohens_dz: Figure,
}

/// Compares a metric's shares under two conditions; both lists belong to the same design.
pub fn compare(
    design: &Design,
    first: &[Share],
    second: &[Share],
    bootstrap: &BootstrapRules,
    paired: &PairedRules,
) -> Comparison {
    let value = |shares: &[Share], values: &[usize]| {
        let sum = values.iter().fold(Share::default(), |sum, &v| sum + shares[v]);
        (sum.denominator > 0.0).then(|| sum.numerator / sum.denominator)
    };
    let difference = |values: &Vec<usize>| Some(value(second, values)? - value(first, values)?);
    let by_tree: Vec<Option<f64>> = design.trees().iter().map(difference).collect();
    let differences: Vec<f64> = by_tree.iter().flatten().copied().collect();
    let shares: Vec<Share> = by_tree.iter().map(|d| d.map_or_else(Share::default, Share::of_one)).collect();
    let interval = Resamples::draw(design.seeds(), bootstrap).interval(&shares);
    let mean = if differences.is_empty() {
        Err(Undefined::NoPairs)
    } else {
        Ok(differences.iter().sum::<f64>() / differences.len() as f64)
    };
    let (ranks, signs) =
        (wilcoxon(&differences, paired.wilcoxon_exact.get() as usize), permutation(&differences, paired));
    Comparison {
        pairs: differences.len() as u32,
        equal: differences.iter().filter(|d| **d == 0.0).count() as u32,
        mean: mean.into(),
        ci95: interval.map_or([None, None], |ends| ends.map(Some)),
        no_interval: interval.err(),
        no_test: ranks.as_ref().err().copied(),
        wilcoxon: ranks.ok(),
        permutation: signs.ok(),
        rank_biserial: rank_biserial(&differences).into(),
        cohens_dz: cohens_dz(&differences).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_rules::{bootstrap, paired};

    fn compared(design: &Design, first: &[(f64, f64)], second: &[(f64, f64)]) -> Comparison {
        let shares = |list: &[(f64, f64)]| -> Vec<Share> {
            list.iter().map(|&(numerator, denominator)| Share { numerator, denominator }).collect()
        };
        let (bootstrap, paired) = (bootstrap(), paired());
        compare(design, &shares(first), &shares(second), &bootstrap, &paired)
    }

    /// Three trees, the first of them twice: success 1/4 -> 3/4, 1/2 -> 1/2, and nothing -> 1.
    #[test]
    fn trees_are_pairs_and_repeats_are_pooled() {
        let design = Design::of([(1, 0), (1, 0), (1, 1), (2, 0)]);
        let first = [(1.0, 3.0), (0.0, 1.0), (1.0, 2.0), (0.0, 0.0)];
        let second = [(2.0, 2.0), (1.0, 2.0), (1.0, 2.0), (1.0, 1.0)];
        let c = compared(&design, &first, &second);
        assert_eq!((c.pairs, c.equal, c.mean.value), (2, 1, Some(0.25)));
        assert_eq!((c.rank_biserial.value, c.wilcoxon.as_ref().map(|w| w.p_value)), (Some(1.0), Some(1.0)));
        assert_eq!(c.permutation.as_ref().map(|p| (p.n, p.p_value)), Some((2, 1.0)));
        let read: Comparison = serde_json::from_str(&serde_json::to_string(&c).unwrap()).unwrap();
        assert_eq!(read, c);
    }

    #[test]
    fn equal_conditions_and_no_pairs_have_reasons() {
        let design = Design::of([(1, 0), (1, 1)]);
        let same = compared(&design, &[(1.0, 2.0); 2], &[(1.0, 2.0); 2]);
        assert_eq!((same.mean.value, same.no_test), (Some(0.0), Some(Undefined::AllZero)));
        assert_eq!((same.ci95, same.cohens_dz.undefined), ([Some(0.0); 2], Some(Undefined::NoSpread)));
        let none = compared(&design, &[(0.0, 0.0); 2], &[(1.0, 2.0); 2]);
        assert_eq!((none.pairs, none.no_test), (0, Some(Undefined::NoPairs)));
        assert_eq!(none.no_interval, Some(Undefined::NothingToMeasure));
        assert!(!serde_json::to_string(&none).unwrap().contains("NaN"));
    }
}
