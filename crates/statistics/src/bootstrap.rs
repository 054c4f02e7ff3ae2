//! Confidence intervals over trees x seeds.
//!
//! Every metric is a ratio of sums over trees, sum(numerator) / sum(denominator); a mean over trees has the
//! denominator 1 for each tree. The hierarchical bootstrap (Davison and Hinkley 1997, section 3.8) draws one seed fewer than there
//! are, with replacement, and of every drawn seed twice as many trees as it has, with replacement; a drawn tree brings all its
//! repeats. Of a single seed its trees are drawn, as many as there are. The interval lies between percentiles of the resampled ratios
//! (Efron and Tibshirani 1993, chapter 13). All metrics share one set of resamples.
//! `docs/decisions/0014-whole-trees-are-resampled.md` gives the reasons.

use std::ops::Add;

use orchard_spec::{Purpose, Stream};

use crate::design::Design;
use crate::quantile::{ascending, quantile};
use crate::rules::BootstrapRules;
use crate::undefined::Undefined;

/// One episode's or one tree's share of a metric.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Share {
    /// Numerator.
    pub numerator: f64,
    /// Denominator; 0 where the metric is undefined.
    pub denominator: f64,
}

impl Share {
    /// A value that counts once, as of one tree.
    pub fn of_one(value: f64) -> Self {
        Self { numerator: value, denominator: 1.0 }
    }

    /// A fraction of two counts.
    pub fn of_counts(numerator: usize, denominator: usize) -> Self {
        Self { numerator: numerator as f64, denominator: denominator as f64 }
    }

    /// Values that count once each: their sum over their number.
    pub fn of_values(values: impl Iterator<Item = f64>) -> Self {
        values.fold(Self::default(), |sum, value| sum + Self::of_one(value))
    }
}

impl Add for Share {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            numerator: self.numerator + other.numerator,
            denominator: self.denominator + other.denominator,
        }
    }
}

/// Resamples of trees. They are drawn anew, and the same, each time that they are asked for: they cost no memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Resamples {
    design: Design,
    rules: BootstrapRules,
}

impl Resamples {
    /// Resamples for trees of one value each, grouped by seed; `groups` holds the values of each seed.
    pub fn draw(groups: &[Vec<usize>], rules: &BootstrapRules) -> Self {
        Self::of(Design::of_groups(groups), rules)
    }

    /// Resamples for a design.
    pub fn of(design: Design, rules: &BootstrapRules) -> Self {
        Self { design, rules: rules.clone() }
    }

    /// The design.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Calls `take` with every resample in turn: its trees, by their index in the design.
    pub fn each(&self, mut take: impl FnMut(&[usize])) {
        let seeds = self.design.seeds();
        if seeds.is_empty() {
            return;
        }
        let mut stream = Stream::new(u64::from(self.rules.seed.get()), 0, Purpose::Bootstrap);
        let mut pick = |n: usize| stream.integer(0, n as u32 - 1) as usize;
        let mut trees = Vec::new();
        for _ in 0..self.rules.resamples.get() {
            trees.clear();
            for _ in 0..seeds_drawn(seeds.len()) {
                let seed = &seeds[pick(seeds.len())];
                for _ in 0..trees_drawn(seeds.len(), seed.len()) {
                    trees.push(seed[pick(seed.len())]);
                }
            }
            take(&trees);
        }
    }

    /// The percentile interval of a metric; `shares` are those of the design's values. Resamples whose denominators sum
    /// to 0 are left out.
    ///
    /// # Errors
    /// The metric is undefined for every tree or for all but one, or a share is not finite.
    pub fn interval(&self, shares: &[Share]) -> Result<[f64; 2], Undefined> {
        let trees: Vec<Share> =
            self.design.trees().iter().map(|values| sum(values.iter().map(|&v| shares[v]))).collect();
        if trees.iter().any(|share| !(share.numerator.is_finite() && share.denominator.is_finite())) {
            return Err(Undefined::NotFinite);
        }
        match trees.iter().filter(|share| share.denominator > 0.0).count() {
            0 => Err(Undefined::NothingToMeasure),
            1 => Err(Undefined::OneTree),
            _ => self.interval_of(|drawn| ratio(drawn.iter().map(|&t| trees[t]))),
        }
    }

    /// Returns the percentile interval of any statistic of a list of trees.
    ///
    /// # Errors
    /// There is only one tree, or no resample defines the statistic.
    pub fn interval_of(&self, statistic: impl Fn(&[usize]) -> Option<f64>) -> Result<[f64; 2], Undefined> {
        if self.design.seeds().iter().map(Vec::len).sum::<usize>() == 1 {
            return Err(Undefined::OneTree);
        }
        let mut values = Vec::new();
        self.each(|trees| values.extend(statistic(trees)));
        let values = ascending(values);
        let tail = 0.5 * (1.0 - self.rules.confidence.si());
        let end = |p| quantile(&values, p).ok_or(Undefined::NothingToMeasure);
        Ok([end(tail)?, end(1.0 - tail)?])
    }
}

/// Seeds in a resample of `seeds` of them. Of n independent draws among K values a mean has (K - 1) / (K n) of their sample variance:
/// with n = K - 1 the K-th part, which is what the mean of K has (Rao and Wu 1988, section 2).
fn seeds_drawn(seeds: usize) -> usize {
    (seeds - 1).max(1)
}

/// Trees drawn of a seed that has `trees`. The spread of trees within seeds is in the spread of the seeds' means already, so that drawing
/// trees counts it a second time; twice the trees halve what that adds.
fn trees_drawn(seeds: usize, trees: usize) -> usize {
    if seeds > 1 { 2 * trees } else { trees }
}

fn sum(shares: impl Iterator<Item = Share>) -> Share {
    shares.fold(Share::default(), Add::add)
}

/// Ratio of the sums; `None` if the denominators sum to 0.
pub fn ratio(shares: impl Iterator<Item = Share>) -> Option<f64> {
    let Share { numerator, denominator } = sum(shares);
    (denominator > 0.0).then(|| numerator / denominator)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_rules::bootstrap;

    fn means(values: &[f64]) -> Vec<Share> {
        values.iter().copied().map(Share::of_one).collect()
    }

    fn rules() -> BootstrapRules {
        bootstrap()
    }

    fn drawn(resamples: &Resamples) -> Vec<Vec<usize>> {
        let mut all = Vec::new();
        resamples.each(|trees| all.push(trees.to_vec()));
        all
    }

    #[test]
    fn same_seed_same_resamples() {
        let groups = [vec![0, 1, 2], vec![3, 4, 5]];
        let resamples = Resamples::draw(&groups, &rules());
        assert_eq!(drawn(&resamples).len(), 10_000);
        assert_eq!(drawn(&resamples), drawn(&resamples));
        let other = BootstrapRules { seed: rules().seed.with_value(2).unwrap(), ..rules() };
        assert_ne!(drawn(&resamples), drawn(&Resamples::draw(&groups, &other)));
    }

    /// A tree is drawn with all its repeats: their sums decide, not their spread.
    #[test]
    fn repeats_stay_with_their_tree() {
        let design = Design::of([(1, 0), (1, 0), (1, 1), (1, 1)]);
        let interval = |values: &[f64]| Resamples::of(design.clone(), &rules()).interval(&means(values));
        assert_eq!(interval(&[0.0, 4.0, 2.0, 2.0]), Ok([2.0, 2.0]));
        assert_eq!(interval(&[0.0, 0.0, 3.0, 1.0]), Ok([0.0, 2.0]));
    }

    /// A seed's trees are drawn only with their seed: with seeds of 0, 10 and 20 without spread inside, every resample of two
    /// seeds has a mean of 0, 5, 10, 15 or 20.
    #[test]
    fn trees_stay_with_their_seed() {
        let resamples = Resamples::draw(&[vec![0, 1], vec![2, 3], vec![4, 5]], &rules());
        let shares = means(&[0.0, 0.0, 10.0, 10.0, 20.0, 20.0]);
        let mut counts = [0_u32; 5];
        for trees in drawn(&resamples) {
            assert_eq!(trees.len(), 8);
            let mean = ratio(trees.iter().map(|&t| shares[t])).unwrap();
            counts[(mean / 5.0) as usize] += 1;
            assert_eq!(mean % 5.0, 0.0);
        }
        // Binomial(10,000, 1/9), (2/9), (3/9): five standard deviations are 157, 208 and 236.
        for (count, expected) in counts.iter().zip([1111_i32, 2222, 3333, 2222, 1111]) {
            assert!((*count as i32 - expected).abs() < 236, "{counts:?}");
        }
        assert_eq!(resamples.interval(&shares), Ok([0.0, 20.0]));
    }

    /// Two stages of a balanced design: the variance of the resampled mean is S_b^2 / K, of the seeds' means, and the
    /// K m / (2 (K - 1)) trees drawn add (population variance within) / (2 (K - 1) m).
    #[test]
    fn variance_of_the_resampled_mean_is_the_known_one() {
        let (seeds, trees) = (5, 6);
        let mut stream = Stream::new(9, 0, Purpose::Test);
        let values: Vec<f64> = (0..seeds * trees).map(|_| stream.normal(0.0, 1.0)).collect();
        let groups: Vec<Vec<usize>> = (0..seeds).map(|s| (s * trees..(s + 1) * trees).collect()).collect();
        let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
        let spread = |of: &[f64]| of.iter().map(|x| (x - mean(of)) * (x - mean(of))).sum::<f64>();
        let of_seeds: Vec<f64> = values.chunks(trees).map(mean).collect();
        let within = values.chunks(trees).map(spread).sum::<f64>() / values.len() as f64;
        let expected =
            spread(&of_seeds) / ((seeds - 1) * seeds) as f64 + within / (2 * (seeds - 1) * trees) as f64;
        let mut resampled = Vec::new();
        Resamples::draw(&groups, &rules())
            .each(|drawn| resampled.push(mean(&drawn.iter().map(|&t| values[t]).collect::<Vec<_>>())));
        let found = spread(&resampled) / resampled.len() as f64;
        // The standard error of a variance of N nearly normal values is sqrt(2 / N), 1.4 %; five of these.
        assert!((found / expected - 1.0).abs() < 0.07, "{found} {expected}");
    }

    /// For one seed the bootstrap distribution of the mean is normal with variance (population variance)/n.
    #[test]
    fn interval_of_a_mean_has_the_known_width() {
        let n = 400;
        let mut stream = Stream::new(5, 0, Purpose::Test);
        let values: Vec<f64> = (0..n).map(|_| stream.normal(3.0, 2.0)).collect();
        let mean = values.iter().sum::<f64>() / f64::from(n);
        let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / f64::from(n);
        let half = 1.959_964 * (variance / f64::from(n)).sqrt();
        let [low, high] =
            Resamples::draw(&[(0..n as usize).collect()], &rules()).interval(&means(&values)).unwrap();
        // A 2.5 % quantile of 10,000 normal draws has the standard error sqrt(p (1-p) / N) / density = 0.027 sigma,
        // 1.4 % of 1.96 sigma; five of these.
        assert!((low - (mean - half)).abs() < 0.07 * half, "{low} {} {half}", mean - half);
        assert!((high - (mean + half)).abs() < 0.07 * half, "{high} {} {half}", mean + half);
    }

    #[test]
    fn undefined_resamples_are_left_out() {
        // The metric is defined for two trees of six, with the same value: resamples without both are left out, the others all give 0.5.
        let mut shares = vec![Share::default(); 6];
        shares[2] = Share { numerator: 1.0, denominator: 2.0 };
        let resamples = Resamples::draw(&[(0..6).collect()], &rules());
        assert_eq!(resamples.interval(&shares), Err(Undefined::OneTree));
        shares[4] = Share { numerator: 3.0, denominator: 6.0 };
        assert_eq!(resamples.interval(&shares), Ok([0.5, 0.5]));
    }

    #[test]
    fn degenerate_samples_have_reasons() {
        let resamples = Resamples::draw(&[(0..6).collect()], &rules());
        assert_eq!(resamples.interval(&[Share::default(); 6]), Err(Undefined::NothingToMeasure));
        assert_eq!(resamples.interval(&means(&[f64::NAN; 6])), Err(Undefined::NotFinite));
        assert_eq!(Resamples::draw(&[], &rules()).interval(&[]), Err(Undefined::NothingToMeasure));
        assert_eq!(Resamples::draw(&[vec![0]], &rules()).interval(&means(&[1.0])), Err(Undefined::OneTree));
        assert_eq!(
            Resamples::draw(&[], &rules()).interval_of(|_| Some(1.0)),
            Err(Undefined::NothingToMeasure)
        );
    }
}
