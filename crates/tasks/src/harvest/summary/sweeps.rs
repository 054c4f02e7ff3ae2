//! Comparison of the conditions of a sweep with its reference condition, tree by tree.

use std::collections::BTreeMap;

use orchard_statistics::MetricDefinition;
use orchard_statistics::holm::holm;
use orchard_statistics::{Comparison, Design, Share, compare};
use serde::{Deserialize, Serialize};

use crate::harvest::episode::EpisodeRecord;
use crate::harvest::matrix::{MatrixSweep, SweepPoint};
use crate::harvest::metrics::harvest_metric;
use crate::harvest::plan::Plan;

/// A sweep of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// Name of its dial.
    pub dial: String,
    /// Unit of its values.
    pub unit: String,
    /// Conditions, by ascending value.
    pub points: Vec<SweepPoint>,
    /// Comparison of every other condition with the reference, by tested metric; empty if the reference was not run.
    pub comparisons: Vec<SweepComparison>,
}

/// Comparison of a condition with the reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepComparison {
    /// The metric.
    pub metric: String,
    /// The reference condition.
    pub reference: String,
    /// The compared condition; differences are this minus reference.
    pub condition: String,
    /// Their differences and tests.
    pub test: Comparison,
    /// Holm-adjusted p-values; the family is all tests of one kind in the sweep.
    pub holm: Adjusted,
}

/// Adjusted p-values; null where the test is undefined.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Adjusted {
    /// p-value of the signed-rank test.
    pub wilcoxon: Option<f64>,
    /// p-value of the permutation test.
    pub permutation: Option<f64>,
}

/// The sweeps of a run, by name.
pub fn sweeps(plan: &Plan, episodes: &[EpisodeRecord]) -> BTreeMap<String, Sweep> {
    let of = |sweep: &MatrixSweep| Sweep {
        dial: sweep.name.clone(),
        unit: sweep.unit.clone(),
        points: sweep.points.clone(),
        comparisons: comparisons(plan, sweep, episodes),
    };
    plan.sweeps.iter().map(|sweep| (sweep.name.clone(), of(sweep))).collect()
}

fn comparisons(plan: &Plan, sweep: &MatrixSweep, episodes: &[EpisodeRecord]) -> Vec<SweepComparison> {
    let MatrixSweep { reference, points, .. } = sweep;
    if !points.iter().any(|point| point.condition == *reference) {
        return Vec::new();
    }
    let tested: Vec<_> = plan.protocol.tested.iter().filter_map(|name| harvest_metric(name)).collect();
    let others = points.iter().filter(|point| point.condition != *reference);
    let mut comparisons: Vec<SweepComparison> = others
        .flat_map(|point| {
            tested.iter().map(|metric| comparison(plan, metric, reference, &point.condition, episodes))
        })
        .collect();
    let wilcoxon = adjusted(&comparisons, |test| test.wilcoxon.as_ref().map(|test| test.p_value));
    let permutation = adjusted(&comparisons, |test| test.permutation.as_ref().map(|test| test.p_value));
    for (comparison, (wilcoxon, permutation)) in
        comparisons.iter_mut().zip(wilcoxon.into_iter().zip(permutation))
    {
        comparison.holm = Adjusted { wilcoxon, permutation };
    }
    comparisons
}

/// Keeps the episodes of the reference that the other condition also has (same tree and start pose), so that a pair differs only in the dial.
fn comparison(
    plan: &Plan,
    metric: &MetricDefinition<EpisodeRecord>,
    reference: &str,
    condition: &str,
    episodes: &[EpisodeRecord],
) -> SweepComparison {
    let of = |name: &str| -> BTreeMap<(u64, u32, u32), Share> {
        let own = episodes.iter().filter(|e| e.key.condition == name);
        own.map(|e| ((e.key.seed, e.key.world, e.key.repeat), (metric.share)(e))).collect()
    };
    let (first, other) = (of(reference), of(condition));
    let pairs = first.iter().filter_map(|(place, share)| Some((place, *share, *other.get(place)?)));
    let (mut places, mut first, mut second) = (Vec::new(), Vec::new(), Vec::new());
    for (&(seed, world, _), a, b) in pairs {
        places.push((seed, world));
        first.push(a);
        second.push(b);
    }
    let (bootstrap, paired) = (&plan.protocol.bootstrap, &plan.protocol.paired);
    SweepComparison {
        metric: metric.info.name.to_owned(),
        reference: reference.to_owned(),
        condition: condition.to_owned(),
        test: compare(&Design::of(places), &first, &second, bootstrap, paired),
        holm: Adjusted::default(),
    }
}

/// Holm's correction over the tests of a kind that are defined.
fn adjusted(
    comparisons: &[SweepComparison],
    p_value: impl Fn(&Comparison) -> Option<f64>,
) -> Vec<Option<f64>> {
    let raw: Vec<Option<f64>> = comparisons.iter().map(|comparison| p_value(&comparison.test)).collect();
    let mut adjusted = holm(&raw.iter().flatten().copied().collect::<Vec<_>>()).into_iter();
    raw.iter().map(|p| p.and_then(|_| adjusted.next())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::{plan, record};
    use crate::harvest::episode::FruitState;
    use crate::harvest::matrix::NOMINAL;

    fn episode(condition: &str, world: u32, repeat: u32, deposited: usize) -> EpisodeRecord {
        let fruit: Vec<(FruitState, bool)> = (0..10)
            .map(|i| (if i < deposited { FruitState::Deposited } else { FruitState::OnTree }, true))
            .collect();
        let mut record = record(&fruit);
        (record.key.condition, record.key.world, record.key.repeat) = (condition.to_owned(), world, repeat);
        record.frames = 1;
        record
    }

    /// Six trees, each one fruit worse: all signs are equal, so that p = 2 / 2^6 for both tests, and the six trees of the second
    /// condition, of which half are worse and half better by as much, give 1.
    #[test]
    fn conditions_are_paired_by_tree_and_corrected_together() {
        let mut plan = plan();
        plan.protocol.tested = vec!["harvest_completeness".to_owned()];
        let point = |condition: &str, value| SweepPoint { condition: condition.to_owned(), value };
        let points = vec![point(NOMINAL, 0.6), point("foliage-1", 1.0), point("foliage-1.5", 1.5)];
        plan.sweeps =
            vec![MatrixSweep { name: "foliage".into(), unit: "1".into(), reference: NOMINAL.into(), points }];
        let mut episodes = Vec::new();
        for world in 0..6_u32 {
            let own = 3 + world as usize / 2;
            episodes.push(episode(NOMINAL, world, 0, own));
            // Another start pose has no partner and must not count.
            episodes.push(episode(NOMINAL, world, 1, 10));
            episodes.push(episode("foliage-1", world, 0, own - 1));
            episodes.push(episode("foliage-1.5", world, 0, own + 1 - 2 * (world as usize % 2)));
        }
        let sweep = &sweeps(&plan, &episodes)["foliage"];
        assert_eq!(sweep.comparisons.len(), 2);
        let worse = &sweep.comparisons[0];
        assert_eq!((worse.condition.as_str(), worse.test.pairs, worse.test.equal), ("foliage-1", 6, 0));
        assert!((worse.test.mean.value.unwrap() + 0.1).abs() < 1e-12);
        let p = |c: &SweepComparison| c.test.permutation.as_ref().unwrap().p_value;
        assert_eq!((p(worse), p(&sweep.comparisons[1])), (2.0 / 64.0, 1.0));
        assert_eq!(worse.holm.permutation, Some(4.0 / 64.0));
        assert_eq!(sweep.comparisons[1].holm.permutation, Some(1.0));

        // Without the nominal condition nothing is compared.
        episodes.retain(|episode| episode.key.condition != NOMINAL);
        plan.sweeps[0].points.remove(0);
        assert!(sweeps(&plan, &episodes)["foliage"].comparisons.is_empty());
    }
}
