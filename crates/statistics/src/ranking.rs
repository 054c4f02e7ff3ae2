//! Predictions with a score: precision-recall curve, average precision and calibration.
//!
//! Predictions of equal score come together: no order among them counts. `cargo xtask check-statistics` holds this against scikit-learn.

use serde::{Deserialize, Serialize};

/// A prediction and its truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Score: the larger, the surer.
    pub score: f64,
    /// True if it is right.
    pub right: bool,
    /// Index of the tree that it is of.
    pub tree: usize,
}

/// Predictions over several trees, the surest first, and the number of things to be found on each tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranking {
    predictions: Vec<Prediction>,
    positives: Vec<u32>,
}

/// A point of the precision-recall curve: what holds if predictions of at least this score are taken.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Least score.
    pub score: f64,
    /// Right predictions over all things to be found.
    pub recall: f64,
    /// Right predictions over predictions.
    pub precision: f64,
}

/// Predictions whose scores lie in one interval; the upper end is excluded, except in the last bin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReliabilityBin {
    /// Ends of the interval.
    pub score: [f64; 2],
    /// Predictions.
    pub n: u32,
    /// Mean of their scores; null without predictions.
    pub mean_score: Option<f64>,
    /// Share of them that is right; null without predictions.
    pub right: Option<f64>,
}

impl Ranking {
    /// Ranks predictions; `positives` are the things to be found on each tree.
    pub fn new(mut predictions: Vec<Prediction>, positives: Vec<u32>) -> Self {
        predictions.sort_by(|a, b| b.score.total_cmp(&a.score));
        Self { predictions, positives }
    }

    /// Predictions, the surest first.
    pub fn predictions(&self) -> &[Prediction] {
        &self.predictions
    }

    /// Things to be found, of all trees.
    pub fn positives(&self) -> u64 {
        self.positives.iter().copied().map(u64::from).sum()
    }

    /// Average precision: the sum over scores of the gain in recall times the precision there, without interpolation, over trees that
    /// count `times[tree]` times each. What no prediction finds counts as not found at any score. `None` if there is nothing to find.
    pub fn average_precision(&self, times: &[u32]) -> Option<f64> {
        let positives: f64 =
            self.positives.iter().zip(times).map(|(&n, &k)| f64::from(n) * f64::from(k)).sum();
        let mut area = 0.0;
        self.walk(times, |_, right, gain, all| {
            if gain > 0.0 {
                area += gain * right / all;
            }
        });
        (positives > 0.0).then(|| area / positives)
    }

    /// Precision-recall curve: the point with which each of `steps` equal steps of the recall is reached, and the last point.
    pub fn curve(&self, steps: u32) -> Vec<CurvePoint> {
        let (positives, mut next, mut last, mut points) = (self.positives() as f64, 0.0, None, Vec::new());
        if positives == 0.0 {
            return points;
        }
        self.walk(&vec![1; self.positives.len()], |score, right, _, all| {
            let point = CurvePoint { score, recall: right / positives, precision: right / all };
            last = Some(point);
            if point.recall * f64::from(steps) >= next {
                points.push(point);
                next = (point.recall * f64::from(steps)).floor() + 1.0;
            }
        });
        points.extend(last.filter(|end| points.last() != Some(end)));
        points
    }

    /// Calls `take` for each score, the largest first, with the right predictions of at least that score, those of just that score, and
    /// all predictions of at least that score.
    fn walk(&self, times: &[u32], mut take: impl FnMut(f64, f64, f64, f64)) {
        let (mut right, mut all) = (0.0, 0.0);
        for equal in self.predictions.chunk_by(|a, b| a.score == b.score) {
            let mut gain = 0.0;
            for prediction in equal {
                let times = f64::from(times[prediction.tree]);
                all += times;
                gain += if prediction.right { times } else { 0.0 };
            }
            right += gain;
            if all > 0.0 {
                take(equal[0].score, right, gain, all);
            }
        }
    }

    /// Predictions by bins of equal width of a score in [0, 1].
    pub fn reliability(&self, bins: u32) -> Vec<ReliabilityBin> {
        let mut sums = vec![(0_u32, 0.0, 0_u32); bins as usize];
        let last = sums.len().saturating_sub(1);
        for p in &self.predictions {
            if let Some((n, score, right)) = sums.get_mut(((p.score * f64::from(bins)) as usize).min(last)) {
                *n += 1;
                *score += p.score;
                *right += u32::from(p.right);
            }
        }
        let bin = |(i, (n, score, right)): (u32, (u32, f64, u32))| {
            let of = |sum: f64| (n > 0).then(|| sum / f64::from(n));
            let score_ends = [i, i + 1].map(|edge| f64::from(edge) / f64::from(bins));
            ReliabilityBin { score: score_ends, n, mean_score: of(score), right: of(f64::from(right)) }
        };
        (0..).zip(sums).map(bin).collect()
    }
}

/// Expected calibration error: the mean over predictions of the distance between mean score and share right of their bin. `None` without
/// predictions.
pub fn expected_calibration_error(bins: &[ReliabilityBin]) -> Option<f64> {
    let n: u32 = bins.iter().map(|bin| bin.n).sum();
    let distance = |bin: &ReliabilityBin| Some(f64::from(bin.n) * (bin.mean_score? - bin.right?).abs());
    (n > 0).then(|| bins.iter().filter_map(distance).sum::<f64>() / f64::from(n))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ranking(of: &[(f64, bool, usize)], positives: &[u32]) -> Ranking {
        let predictions = of.iter().map(|&(score, right, tree)| Prediction { score, right, tree }).collect();
        Ranking::new(predictions, positives.to_vec())
    }

    #[test]
    fn average_precision_by_hand() {
        // Right, wrong, right; one of three is never found: (1/1 + 2/3) / 3.
        let three = ranking(&[(0.2, true, 0), (0.9, true, 0), (0.5, false, 0)], &[3]);
        assert_eq!(three.average_precision(&[1]), Some((1.0 + 2.0 / 3.0) / 3.0));
        assert_eq!(three.average_precision(&[2]), three.average_precision(&[1]));
        // Equal scores have one precision, in whatever order they come.
        for order in [[true, false], [false, true]] {
            let equal = ranking(&[(0.5, order[0], 0), (0.5, order[1], 0)], &[1]);
            assert_eq!(equal.average_precision(&[1]), Some(0.5));
        }
        // Without the second tree the first is perfect.
        let two = ranking(&[(0.9, false, 1), (0.8, true, 0)], &[1, 1]);
        assert_eq!(two.average_precision(&[1, 0]), Some(1.0));
        assert_eq!(two.average_precision(&[1, 1]), Some(0.25));
        assert_eq!(ranking(&[(0.9, false, 0)], &[0]).average_precision(&[1]), None);
        assert_eq!(ranking(&[], &[2]).average_precision(&[1]), Some(0.0));
    }

    #[test]
    fn a_curve_has_a_point_a_step_and_ends_at_the_last_prediction() {
        let mut all: Vec<(f64, bool, usize)> =
            (0..100).map(|i| (1.0 - f64::from(i) / 200.0, true, 0)).collect();
        all.push((0.1, false, 0));
        let curve = ranking(&all, &[100]).curve(10);
        assert_eq!(curve.len(), 12, "{curve:?}");
        assert_eq!(curve[0], CurvePoint { score: 1.0, recall: 0.01, precision: 1.0 });
        assert_eq!(curve[11], CurvePoint { score: 0.1, recall: 1.0, precision: 100.0 / 101.0 });
        assert!(curve.windows(2).all(|pair| pair[0].recall <= pair[1].recall));
        assert!(ranking(&all, &[0]).curve(10).is_empty());
    }

    #[test]
    fn calibration_by_hand() {
        let r = ranking(&[(1.0, true, 0), (0.9, true, 0), (0.6, false, 0), (0.1, false, 0)], &[2]);
        let bins = r.reliability(2);
        assert_eq!(bins.iter().map(|bin| bin.n).collect::<Vec<_>>(), [1, 3]);
        assert_eq!((bins[0].mean_score, bins[0].right), (Some(0.1), Some(0.0)));
        let (mean, right) = (2.5 / 3.0, 2.0 / 3.0);
        let expected: f64 = (0.1 + 3.0 * (mean - right)) / 4.0;
        assert!((expected_calibration_error(&bins).unwrap() - expected).abs() < 1e-15);
        assert_eq!(expected_calibration_error(&ranking(&[], &[1]).reliability(5)), None);
        assert_eq!(ranking(&[], &[1]).reliability(5)[0].mean_score, None);
    }
}
