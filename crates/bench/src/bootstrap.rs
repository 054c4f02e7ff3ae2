//! Confidence intervals over trees x seeds.
//!
//! Every metric is a ratio of sums over trees, sum(numerator) / sum(denominator); a mean over trees has the
//! denominator 1 for each tree. The hierarchical bootstrap (Davison and Hinkley 1997, section 3.8) draws seeds
//! with replacement and, for every drawn seed, as many of its trees with replacement; the interval lies between
//! percentiles of the resampled ratios (Efron and Tibshirani 1993, chapter 13). All metrics share one set of
//! resamples.

use orchard_spec::{Purpose, Stream};

use crate::protocol::BootstrapRules;
use crate::quantile::{ascending, quantile};

/// One tree's share of a metric.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Share {
    /// Numerator.
    pub numerator: f64,
    /// Denominator; 0 where the tree says nothing about the metric.
    pub denominator: f64,
}

/// Resamples of trees: each a list of tree indices.
#[derive(Debug, Clone, PartialEq)]
pub struct Resamples {
    draws: Vec<Vec<usize>>,
    confidence: f64,
}

impl Resamples {
    /// Draws resamples for trees grouped by seed; `groups` holds the tree indices of each seed.
    pub fn draw(groups: &[Vec<usize>], rules: &BootstrapRules) -> Self {
        let groups: Vec<&Vec<usize>> = groups.iter().filter(|g| !g.is_empty()).collect();
        let mut stream = Stream::new(u64::from(rules.seed.get()), 0, Purpose::Bootstrap);
        let mut pick = |n: usize| stream.integer(0, n as u32 - 1) as usize;
        let draws = (0..rules.resamples.get())
            .map(|_| {
                let mut trees = Vec::new();
                for _ in 0..groups.len() {
                    let group = groups[pick(groups.len())];
                    for _ in 0..group.len() {
                        trees.push(group[pick(group.len())]);
                    }
                }
                trees
            })
            .collect();
        Self { draws, confidence: rules.confidence.si() }
    }

    /// The percentile interval of a metric; `None` if no resample defines it. Resamples whose denominators sum
    /// to 0 say nothing and are left out.
    pub fn interval(&self, shares: &[Share]) -> Option<[f64; 2]> {
        self.interval_of(|trees| ratio(trees.iter().map(|&t| shares[t])))
    }

    /// The same of any statistic of a list of trees.
    pub fn interval_of(&self, statistic: impl Fn(&[usize]) -> Option<f64>) -> Option<[f64; 2]> {
        let values = ascending(self.draws.iter().filter_map(|trees| statistic(trees)));
        let tail = 0.5 * (1.0 - self.confidence);
        Some([quantile(&values, tail)?, quantile(&values, 1.0 - tail)?])
    }
}

/// Ratio of the sums; `None` if the denominators sum to 0.
pub fn ratio(shares: impl Iterator<Item = Share>) -> Option<f64> {
    let (numerator, denominator) =
        shares.fold((0.0, 0.0), |(n, d), share| (n + share.numerator, d + share.denominator));
    (denominator > 0.0).then(|| numerator / denominator)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Protocol;

    fn means(values: &[f64]) -> Vec<Share> {
        values.iter().map(|&numerator| Share { numerator, denominator: 1.0 }).collect()
    }

    fn rules() -> BootstrapRules {
        Protocol::paper().bootstrap
    }

    #[test]
    fn same_seed_same_resamples() {
        let groups = [vec![0, 1, 2], vec![3, 4, 5]];
        assert_eq!(Resamples::draw(&groups, &rules()), Resamples::draw(&groups, &rules()));
        let other = BootstrapRules { seed: rules().seed.with_value(2).unwrap(), ..rules() };
        assert_ne!(Resamples::draw(&groups, &rules()), Resamples::draw(&groups, &other));
    }

    /// A seed's trees are drawn only with their seed: with seeds of 0 and 10 without spread inside, every
    /// resample of two seeds has mean 0, 5 or 10.
    #[test]
    fn trees_stay_with_their_seed() {
        let resamples = Resamples::draw(&[vec![0, 1], vec![2, 3]], &rules());
        let shares = means(&[0.0, 0.0, 10.0, 10.0]);
        let mut counts = [0_u32; 3];
        for trees in &resamples.draws {
            let mean = ratio(trees.iter().map(|&t| shares[t])).unwrap();
            counts[(mean / 5.0) as usize] += 1;
            assert_eq!(mean % 5.0, 0.0);
        }
        // Binomial(2000, 1/4), (1/2), (1/4): five standard deviations are 97 and 112.
        for (count, expected) in counts.iter().zip([500_i32, 1000, 500]) {
            assert!((*count as i32 - expected).abs() < 112, "{counts:?}");
        }
        assert_eq!(resamples.interval(&shares), Some([0.0, 10.0]));
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
        // A 2.5 % quantile of 2,000 normal draws has the standard error sqrt(p (1-p) / N) / density = 0.060 sigma,
        // 3.1 % of 1.96 sigma; five of these.
        assert!((low - (mean - half)).abs() < 0.155 * half, "{low} {} {half}", mean - half);
        assert!((high - (mean + half)).abs() < 0.155 * half, "{high} {} {half}", mean + half);
    }

    /// 95 % intervals of 18 normal trees cover the true mean about as often as the percentile bootstrap does in
    /// theory: its half-width is 1.96 s sqrt((n-1)/n)/sqrt(n) where Student's is 2.110, so 93 % are expected.
    #[test]
    fn coverage() {
        let trials = 400;
        let covered = (0..trials)
            .filter(|&trial| {
                let mut stream = Stream::new(11, trial, Purpose::Test);
                let values: Vec<f64> = (0..18).map(|_| stream.normal(0.0, 1.0)).collect();
                let rules =
                    BootstrapRules { resamples: rules().resamples.with_value(500).unwrap(), ..rules() };
                let [low, high] =
                    Resamples::draw(&[(0..18).collect()], &rules).interval(&means(&values)).unwrap();
                (low..=high).contains(&0.0)
            })
            .count();
        let rate = covered as f64 / f64::from(trials);
        // Four standard errors of a proportion of 0.93 in 400 trials are 0.051.
        assert!((rate - 0.93).abs() < 0.051, "{rate}");
    }

    #[test]
    fn undefined_resamples_are_left_out() {
        // One tree of six says something: a third of the resamples miss it, the others all give 0.5.
        let mut shares = vec![Share::default(); 6];
        shares[2] = Share { numerator: 1.0, denominator: 2.0 };
        let resamples = Resamples::draw(&[(0..6).collect()], &rules());
        assert_eq!(resamples.interval(&shares), Some([0.5, 0.5]));
        assert_eq!(resamples.interval(&[Share::default(); 6]), None);
        assert_eq!(Resamples::draw(&[], &rules()).interval(&[]), None);
    }
}
