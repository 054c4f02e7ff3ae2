//! Components of variance: between seeds, between the trees of a seed, between the repeats of a tree.
//!
//! y_ijk = mu + a_i + b_ij + e_ijk, all random: seed i, tree j, repeat k. Estimated by the analysis of variance, that is by equating
//! mean squares to what they are expected to be, here for any numbers n_ij of repeats (Searle, Casella and
//! McCulloch 1992). Estimates can be negative; a component is then reported as 0, beside the raw value.

use serde::{Deserialize, Serialize};

use crate::design::Design;
use crate::undefined::Undefined;

/// One component.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Component {
    /// The estimate, 0 where the raw one is negative \[square of the metric's unit\].
    pub variance: Option<f64>,
    /// The estimate as it came out.
    pub raw: Option<f64>,
    /// Degrees of freedom of its mean square.
    pub df: u32,
    /// Reason why there is none, if so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub undefined: Option<Undefined>,
}

/// All components of a metric.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct VarianceComponents {
    /// Between seeds.
    pub between_seeds: Component,
    /// Between the trees of a seed.
    pub between_trees: Component,
    /// Within a tree: between its repeats, from run to run.
    pub within_tree: Component,
    /// Number of values used: episodes for which the metric is defined.
    pub n: u32,
}

impl Component {
    fn of(estimate: Result<f64, Undefined>, df: usize) -> Self {
        let estimate =
            estimate.and_then(|raw| if raw.is_finite() { Ok(raw) } else { Err(Undefined::NotFinite) });
        Self {
            variance: estimate.ok().map(|raw| raw.max(0.0)),
            raw: estimate.ok(),
            df: df as u32,
            undefined: estimate.err(),
        }
    }
}

/// A seed's values, tree by tree; every tree has one.
type SeedValues = Vec<Vec<f64>>;

/// Estimates the variance components of values; undefined values are `None` and are left out.
pub fn variance_components(design: &Design, values: &[Option<f64>]) -> VarianceComponents {
    let of_tree =
        |tree: &usize| -> Vec<f64> { design.trees()[*tree].iter().filter_map(|&v| values[v]).collect() };
    let of_seed = |trees: &Vec<usize>| -> SeedValues {
        trees.iter().map(of_tree).filter(|values| !values.is_empty()).collect()
    };
    let seeds: Vec<SeedValues> =
        design.seeds().iter().map(of_seed).filter(|trees| !trees.is_empty()).collect();
    Nested::of(&seeds).components()
}

/// Sums of squares and the coefficients of the expected mean squares.
#[derive(Default)]
struct Nested {
    seeds: usize,
    trees: usize,
    n: usize,
    ss_seeds: f64,
    ss_trees: f64,
    ss_within: f64,
    /// Sum over seeds of (sum of n_ij^2) / n_i.
    trees_within: f64,
    /// Sum of n_ij^2.
    trees_all: f64,
    /// Sum of n_i^2.
    seeds_all: f64,
}

impl Nested {
    fn of(seeds: &[SeedValues]) -> Self {
        let mut nested = Self { seeds: seeds.len(), ..Self::default() };
        let all = || seeds.iter().flatten().flatten();
        nested.n = all().count();
        let mean = mean(all());
        for trees in seeds {
            let of_seed = trees.iter().flatten().count() as f64;
            let seed_mean = self::mean(trees.iter().flatten());
            nested.trees += trees.len();
            nested.seeds_all += of_seed * of_seed;
            nested.ss_seeds += of_seed * square(seed_mean - mean);
            let squares: f64 = trees.iter().map(|tree| square(tree.len() as f64)).sum();
            nested.trees_all += squares;
            nested.trees_within += squares / of_seed;
            for tree in trees {
                let tree_mean = self::mean(tree.iter());
                nested.ss_trees += tree.len() as f64 * square(tree_mean - seed_mean);
                nested.ss_within += tree.iter().map(|y| square(y - tree_mean)).sum::<f64>();
            }
        }
        nested
    }

    /// E(MS_within) = e, E(MS_trees) = e + k1 b, E(MS_seeds) = e + k2 b + k3 a.
    fn components(&self) -> VarianceComponents {
        let n = self.n as f64;
        let df_seeds = self.seeds.saturating_sub(1);
        let (df_trees, df_within) = (self.trees - self.seeds, self.n - self.trees);
        let e = if self.n == 0 {
            Err(Undefined::NothingToMeasure)
        } else if df_within == 0 {
            Err(Undefined::NoRepeats)
        } else {
            Ok(self.ss_within / df_within as f64)
        };
        let b = e.and_then(|e| {
            let k1 = (n - self.trees_within) / df_trees as f64;
            if df_trees == 0 {
                Err(Undefined::OneTreeASeed)
            } else {
                Ok((self.ss_trees / df_trees as f64 - e) / k1)
            }
        });
        let a = e.and_then(|e| {
            let b = b?;
            if df_seeds == 0 {
                return Err(Undefined::OneSeed);
            }
            let k2 = (self.trees_within - self.trees_all / n) / df_seeds as f64;
            let k3 = (n - self.seeds_all / n) / df_seeds as f64;
            Ok((self.ss_seeds / df_seeds as f64 - e - k2 * b) / k3)
        });
        VarianceComponents {
            between_seeds: Component::of(a, df_seeds),
            between_trees: Component::of(b, df_trees),
            within_tree: Component::of(e, df_within),
            n: self.n as u32,
        }
    }
}

fn mean<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    sum / n
}

fn square(x: f64) -> f64 {
    x * x
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_spec::{Purpose, Stream};

    fn of(seeds: u64, trees: u32, repeats: usize) -> Design {
        let place = |i: usize| ((i / repeats / trees as usize) as u64, (i / repeats) as u32 % trees);
        Design::of((0..seeds as usize * trees as usize * repeats).map(place))
    }

    /// 2 seeds x 2 trees x 2 repeats: tree means 1, 3 and 7, 9, repeats 0.5 off: MS_within = 0.5, MS_trees = 2 x 2 = 4 x (1 + 1) / 2,
    /// MS_seeds = 4 x 2 x 9 = 72: e = 0.5, b = (4 - 0.5) / 2, a = (72 - 4) / 4.
    #[test]
    fn balanced_by_hand() {
        let values = [0.5, 1.5, 2.5, 3.5, 6.5, 7.5, 8.5, 9.5].map(Some);
        let c = variance_components(&of(2, 2, 2), &values);
        assert_eq!(c.within_tree, Component { variance: Some(0.5), raw: Some(0.5), df: 4, undefined: None });
        assert_eq!((c.between_trees.raw, c.between_trees.df), (Some(1.75), 2));
        assert_eq!((c.between_seeds.raw, c.between_seeds.df, c.n), (Some(17.0), 1, 8));
    }

    /// Equal seeds and equal trees: MS_trees = MS_seeds = 0, and what is left over is negative.
    #[test]
    fn negative_estimates_are_reported_as_zero() {
        let values = [0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0].map(Some);
        let c = variance_components(&of(2, 2, 2), &values);
        assert_eq!((c.within_tree.raw, c.between_trees.raw), (Some(0.5), Some(-0.25)));
        // (0 - 0.5 - 2 (-0.25)) / 4 = 0.
        assert_eq!((c.between_trees.variance, c.between_seeds.raw), (Some(0.0), Some(0.0)));
    }

    /// The estimators are unbiased: over many samples their mean is the truth, with missing values too.
    #[test]
    fn unbiased() {
        let (a, b, e) = (0.5, 2.0, 1.0);
        let samples = 4000;
        let design = of(5, 4, 3);
        let mut sums = [[0.0; 2]; 3];
        let mut stream = Stream::new(3, 0, Purpose::Test);
        for _ in 0..samples {
            let mut values = Vec::new();
            for trees in design.seeds() {
                let seed = stream.normal(0.0, f64::sqrt(a));
                for tree in trees {
                    let mean = seed + stream.normal(0.0, f64::sqrt(b));
                    values.extend(
                        (0..design.trees()[*tree].len())
                            .map(|_| Some(mean + stream.normal(0.0, f64::sqrt(e)))),
                    );
                }
            }
            // Another pattern in every tree, one tree without any value.
            for missing in [0, 4, 5, 6, 7, 8, 31, 59] {
                values[missing] = None;
            }
            let c = variance_components(&design, &values);
            for (sum, component) in sums.iter_mut().zip([c.between_seeds, c.between_trees, c.within_tree]) {
                let raw = component.raw.unwrap();
                sum[0] += raw;
                sum[1] += raw * raw;
            }
        }
        for ([sum, squares], truth) in sums.into_iter().zip([a, b, e]) {
            let mean = sum / f64::from(samples);
            let error = ((squares / f64::from(samples) - mean * mean) / f64::from(samples)).sqrt();
            assert!((mean - truth).abs() < 4.0 * error, "{mean} +- {error}, {truth}");
        }
    }

    #[test]
    fn degenerate_samples_have_reasons() {
        let why = |design: &Design, values: &[Option<f64>]| {
            let c = variance_components(design, values);
            [c.between_seeds, c.between_trees, c.within_tree].map(|c| c.undefined)
        };
        let none = Some(Undefined::NothingToMeasure);
        assert_eq!(why(&of(2, 2, 2), &[None; 8]), [none; 3]);
        assert_eq!(why(&Design::default(), &[]), [none; 3]);
        assert_eq!(why(&of(2, 2, 1), &[Some(1.0); 4]), [Some(Undefined::NoRepeats); 3]);
        assert_eq!(why(&of(1, 2, 2), &[Some(1.0); 4]), [Some(Undefined::OneSeed), None, None]);
        let lone = Some(Undefined::OneTreeASeed);
        assert_eq!(why(&of(2, 1, 2), &[Some(1.0); 4]), [lone, lone, None]);
        assert_eq!(why(&of(2, 2, 2), &[Some(f64::NAN); 8])[2], Some(Undefined::NotFinite));
        // No spread at all is no error.
        let c = variance_components(&of(2, 2, 2), &[Some(1.0); 8]);
        assert_eq!(
            (c.between_seeds.variance, c.between_trees.variance, c.within_tree.variance),
            (Some(0.0), Some(0.0), Some(0.0))
        );
    }
}
