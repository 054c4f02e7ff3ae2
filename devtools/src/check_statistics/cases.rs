//! Seeded samples with this project's results: small and large, with ties and zeros, skewed, uneven.

use orchard_spec::{Purpose, Stream};
use orchard_statistics::effect::{cohens_dz, rank_biserial};
use orchard_statistics::holm::holm;
use orchard_statistics::permutation::{Permutation, permutation};
use orchard_statistics::ranking::{CurvePoint, Prediction, Ranking, ReliabilityBin};
use orchard_statistics::wilcoxon::{Wilcoxon, wilcoxon};
use orchard_statistics::{
    BootstrapRules, Design, Resamples, Share, Undefined, VarianceComponents, variance_components,
};
use orchard_tasks::protocol::Protocol;
use serde::Serialize;

/// Everything that is compared.
#[derive(Serialize)]
pub struct Cases {
    wilcoxon: Vec<Tested<Wilcoxon>>,
    permutation: Vec<Tested<Permutation>>,
    effects: Vec<Tested<Effects>>,
    holm: Vec<Holm>,
    components: Vec<Components>,
    one_way: Vec<Components>,
    bootstrap: Vec<Bootstrap>,
    percentile: Vec<Bootstrap>,
    ranked: Vec<Ranked>,
}

/// Predictions with a score, some with equal ones, and what is to be found, of which some has no prediction.
#[derive(Serialize)]
struct Ranked {
    /// Score and truth.
    predictions: Vec<(f64, bool)>,
    positives: u32,
    average_precision: f64,
    curve: Vec<CurvePoint>,
    bins: Vec<ReliabilityBin>,
}

#[derive(Serialize)]
struct Tested<T> {
    differences: Vec<f64>,
    #[serde(flatten)]
    outcome: T,
}

#[derive(Serialize)]
struct Effects {
    cohens_dz: f64,
    rank_biserial: f64,
}

#[derive(Serialize)]
struct Holm {
    p_values: Vec<f64>,
    adjusted: Vec<f64>,
}

#[derive(Serialize)]
struct Components {
    values: Vec<Value>,
    components: VarianceComponents,
}

#[derive(Serialize)]
struct Value {
    seed: u64,
    tree: u32,
    value: Option<f64>,
}

#[derive(Serialize)]
struct Bootstrap {
    /// Numerator and denominator of each tree.
    trees: Vec<[f64; 2]>,
    confidence: f64,
    /// The trees of every resample; empty where scipy draws its own.
    resamples: Vec<Vec<usize>>,
    interval: [f64; 2],
}

/// Numbers of pairs: below and above the limit of the exact enumeration.
const PAIRS: [usize; 9] = [1, 2, 3, 6, 13, 18, 30, 50, 60];
/// Number of resamples passed to scipy; the rule is the same for any number.
const RESAMPLES: u32 = 500;

impl Cases {
    /// Makes all samples; an error gives the reason why a sample has no result.
    pub fn all() -> Result<Self, String> {
        let mut stream = Stream::new(20_250_704, 0, Purpose::Test);
        let samples = differences(&mut stream);
        let told = |problem: Undefined| problem.to_string();
        let rules = Protocol::paper().paired;
        // scipy enumerates every sign pattern: small samples only; ours are both enumerated and sampled.
        let few = rules.permutation_exact.with_value(5)?;
        let sampled = orchard_statistics::PairedRules { permutation_exact: few, ..rules.clone() };
        let (mut ranks, mut signs, mut effects) = (Vec::new(), Vec::new(), Vec::new());
        for differences in &samples {
            let with = |outcome| Tested { differences: differences.clone(), outcome };
            // With the limit of the protocol, and with the normal approximation everywhere.
            for exact in [rules.wilcoxon_exact.get() as usize, 0] {
                ranks.push(with(wilcoxon(differences, exact).map_err(told)?));
            }
            if (2..=13).contains(&differences.len()) {
                for rules in [&rules, &sampled] {
                    let outcome = permutation(differences, rules).map_err(told)?;
                    signs.push(Tested { differences: differences.clone(), outcome });
                }
            }
            if differences.len() > 1 {
                let outcome = Effects {
                    cohens_dz: cohens_dz(differences).map_err(told)?,
                    rank_biserial: rank_biserial(differences).map_err(told)?,
                };
                effects.push(Tested { differences: differences.clone(), outcome });
            }
        }
        let holm = [1, 2, 5, 24].map(|n| {
            // Coarse, so that some are equal.
            let p_values: Vec<f64> =
                (0..n).map(|_| f64::from(stream.integer(0, 60)) * stream.unit().round() / 1000.0).collect();
            Holm { adjusted: holm(&p_values), p_values }
        });
        let bootstrap = vec![ratios(&mut stream, &[6, 6, 6, 6, 6])?, ratios(&mut stream, &[6, 1, 3])?];
        Ok(Self {
            wilcoxon: ranks,
            permutation: signs,
            effects,
            holm: holm.into(),
            components: vec![
                nested(&mut stream, 5, 6, 3, 0.0),
                nested(&mut stream, 5, 6, 3, 0.3),
                nested(&mut stream, 2, 2, 2, 0.0),
                nested(&mut stream, 4, 5, 4, 0.5),
            ],
            one_way: vec![nested(&mut stream, 1, 6, 3, 0.0), nested(&mut stream, 1, 2, 5, 0.0)],
            bootstrap,
            percentile: vec![means(&mut stream, 30)?, means(&mut stream, 12)?],
            ranked: [(1, 0, 0.0), (20, 3, 0.0), (300, 0, 0.0), (300, 40, 50.0), (2000, 500, 0.0)]
                .map(|(n, missed, coarse)| ranked(&mut stream, n, missed, coarse))
                .into(),
        })
    }
}

/// Samples of every size: smooth ones, whole numbers with ties and zeros, skewed ones.
fn differences(stream: &mut Stream) -> Vec<Vec<f64>> {
    let mut samples = Vec::new();
    for n in PAIRS {
        samples.push((0..n).map(|_| stream.normal(0.4, 1.0)).collect());
        let mut whole: Vec<f64> = (0..n).map(|_| stream.normal(0.7, 2.0).round()).collect();
        // Not all zero, and not all the same.
        whole[0] = 1.0;
        if let Some(last) = whole.get_mut(1) {
            *last = -2.0;
        }
        samples.push(whole);
        samples.push((0..n).map(|_| stream.unit() * stream.unit() * stream.unit() - 0.1).collect());
    }
    samples
}

/// Seeds x trees x repeats, of which a share is missing (never a tree's first two).
fn nested(stream: &mut Stream, seeds: u64, trees: u32, repeats: u32, missing: f64) -> Components {
    let mut values = Vec::new();
    for seed in 0..seeds {
        let of_seed = stream.normal(3.0, 0.5);
        for tree in 0..trees {
            let of_tree = stream.normal(of_seed, 1.0);
            for repeat in 0..repeats {
                let value = stream.normal(of_tree, 1.5);
                let lost = repeat > 1 && stream.chance(missing);
                values.push(Value { seed, tree, value: (!lost).then_some(value) });
            }
        }
    }
    let design = Design::of(values.iter().map(|v| (v.seed, v.tree)));
    let list: Vec<Option<f64>> = values.iter().map(|v| v.value).collect();
    Components { components: variance_components(&design, &list), values }
}

fn rules(resamples: u32) -> Result<BootstrapRules, String> {
    let rules = Protocol::paper().bootstrap;
    Ok(BootstrapRules { resamples: rules.resamples.with_value(resamples)?, ..rules })
}

/// Ratios of sums, such as placed over attempts, of so many trees in each seed.
fn ratios(stream: &mut Stream, seeds: &[usize]) -> Result<Bootstrap, String> {
    let mut places = Vec::new();
    for (seed, &trees) in seeds.iter().enumerate() {
        places.extend((0..trees).map(|tree| (seed as u64, tree as u32)));
    }
    let shares: Vec<Share> = places
        .iter()
        .map(|_| {
            let denominator = stream.integer(1, 12);
            Share {
                numerator: f64::from(stream.integer(0, denominator)),
                denominator: f64::from(denominator),
            }
        })
        .collect();
    let resamples = Resamples::of(Design::of(places), &rules(RESAMPLES)?);
    let mut drawn = Vec::new();
    resamples.each(|trees| drawn.push(trees.to_vec()));
    told(&shares, &resamples, drawn)
}

/// Means over the trees of one seed.
fn means(stream: &mut Stream, trees: usize) -> Result<Bootstrap, String> {
    let shares: Vec<Share> = (0..trees).map(|_| Share::of_one(stream.normal(2.0, 3.0))).collect();
    let rules = Protocol::paper().bootstrap;
    told(&shares, &Resamples::draw(&[(0..trees).collect()], &rules), Vec::new())
}

/// Predictions of which the surer are the more often right. With `coarse` the scores are multiples of its inverse.
fn ranked(stream: &mut Stream, n: usize, missed: u32, coarse: f64) -> Ranked {
    let mut one = |i: usize| {
        let score = stream.unit();
        let right = i == 0 || stream.chance(score);
        (if coarse > 0.0 { (coarse * score).round() / coarse } else { score }, right)
    };
    let predictions: Vec<(f64, bool)> = (0..n).map(&mut one).collect();
    let positives = predictions.iter().filter(|(_, right)| *right).count() as u32 + missed;
    let of = |&(score, right): &(f64, bool)| Prediction { score, right, tree: 0 };
    let ranking = Ranking::new(predictions.iter().map(of).collect(), vec![positives]);
    Ranked {
        // One prediction is right, so there is something to find.
        average_precision: ranking.average_precision(&[1]).unwrap_or(f64::NAN),
        curve: ranking.curve(50),
        bins: ranking.reliability(10),
        predictions,
        positives,
    }
}

fn told(shares: &[Share], resamples: &Resamples, drawn: Vec<Vec<usize>>) -> Result<Bootstrap, String> {
    Ok(Bootstrap {
        trees: shares.iter().map(|share| [share.numerator, share.denominator]).collect(),
        confidence: Protocol::paper().bootstrap.confidence.si(),
        resamples: drawn,
        interval: resamples.interval(shares).map_err(|e| e.to_string())?,
    })
}
