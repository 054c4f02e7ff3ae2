//! Detections ranked by their score: average precision, precision-recall curves, calibration.
//!
//! Fruit counts if enough of it is visible ([`crate::detect::FoundRules`]) and its centre lies in the camera's range. Of the spheres within so many radii of
//! such a fruit the one with the largest score is right, all others are wrong. A sphere within one radius of fruit that is visible but
//! does not count is neither. All else is wrong, a sphere where fruit shows no pixel included.

use std::collections::{BTreeMap, BTreeSet};

use orchard_geometry::Vec3;
use orchard_statistics::metric::interval_ends;
use orchard_statistics::ranking::{
    CurvePoint, Prediction, Ranking, ReliabilityBin, expected_calibration_error,
};
use orchard_statistics::{Metric, Resamples, Share};
use serde::{Deserialize, Serialize};

use crate::detect::plan::DetectPlan;
use crate::detect::record::{DensityRecord, DetectRecord, FruitSeen, HangingFruit, ImageRecord};
use crate::detect::spread::Spread;
use crate::zones::{Zone, ZoneTable};

/// Ranked detections at one foliage density. Keys of maps are the largest distance of a right detection's centre, in radii of the fruit.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RankingSummary {
    /// Average precision.
    pub ap: BTreeMap<String, Spread>,
    /// Precision-recall curves.
    pub curves: BTreeMap<String, Vec<CurvePoint>>,
    /// Average precision over fruit of one bin of the visible fraction; all wrong detections count in each.
    pub by_visible_fraction: Vec<RankedBin>,
    /// Average precision over fruit of one zone; wrong detections count in the zone of their own centre.
    pub by_zone: ZoneTable<RankedFruit>,
    /// Scores beside the share that is right, within the largest distance.
    pub calibration: Calibration,
}

/// Fruit of one kind.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RankedFruit {
    /// Fruit, summed over images.
    pub fruit: u64,
    /// Average precision; null without fruit.
    pub ap: BTreeMap<String, Option<f64>>,
}

/// Fruit of one bin of the visible fraction; the upper end is excluded, except in the last bin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RankedBin {
    /// Ends.
    pub visible_fraction: [f64; 2],
    /// The fruit.
    #[serde(flatten)]
    pub ranked: RankedFruit,
}

/// Agreement of scores with the share of detections that is right.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Brier score: mean square of the score less 1 of a right detection, less 0 of a wrong one.
    pub brier: Metric,
    /// Mean distance between mean score and share right of a detection's bin.
    pub expected_error: Option<f64>,
    /// Bins of the score.
    pub bins: Vec<ReliabilityBin>,
}

impl Default for Calibration {
    fn default() -> Self {
        let brier = Metric { mean: None, ci95: [None; 2], n: 0, undefined: None };
        Self { brier, expected_error: None, bins: Vec::new() }
    }
}

/// One sphere in an image: score and centre \[m, world\].
type Sphere = (f64, Vec3);

/// Rule by which a ranking counts fruit and detections.
struct Choice<'a> {
    /// Largest distance of a right detection \[radii\].
    radii: f64,
    /// True for fruit to be found.
    fruit: &'a dyn Fn(&DetectRecord, &FruitSeen) -> bool,
    /// True for wrong detections that count.
    wrong: &'a dyn Fn(&DetectRecord, &Vec3) -> bool,
}

/// Ranks the detections of all trees at a density; `resamples` index into the trees.
pub(crate) fn ranked(
    plan: &DetectPlan,
    trees: &[(&DetectRecord, Option<&DensityRecord>)],
    resamples: &Resamples,
) -> RankingSummary {
    let (rules, found) = (&plan.protocol.detect.ranking, &plan.protocol.detect.found);
    let (near, far) = plan.camera.range();
    let countable = |f: &FruitSeen| f.visible_px >= found.pixels.get() && (near..=far).contains(&f.depth);
    let counts =
        |_: &DetectRecord, f: &FruitSeen| countable(f) && f.visible_fraction() >= found.visible_fraction.si();
    let every = |_: &DetectRecord, _: &Vec3| true;
    let mut out = RankingSummary::default();
    let radii: Vec<f64> = rules.radii.iter().map(|radii| radii.si()).collect();
    for &radii in &radii {
        let ranking = rank(trees, &Choice { radii, fruit: &counts, wrong: &every });
        out.ap.insert(radii.to_string(), average_precision(&ranking, trees.len(), resamples));
        out.curves.insert(radii.to_string(), ranking.curve(rules.steps.get()));
    }
    let of = |fruit: &dyn Fn(&DetectRecord, &FruitSeen) -> bool,
              wrong: &dyn Fn(&DetectRecord, &Vec3) -> bool| {
        let mut ranked = RankedFruit::default();
        for &radii in &radii {
            let ranking = rank(trees, &Choice { radii, fruit, wrong });
            ranked.fruit = ranking.positives();
            ranked.ap.insert(radii.to_string(), ranking.average_precision(&vec![1; trees.len()]));
        }
        ranked
    };
    for bin in 0..found.bins.get() {
        let in_bin =
            |_: &DetectRecord, f: &FruitSeen| countable(f) && f.fraction_bin(found.bins.get()) == bin;
        let visible_fraction = [bin, bin + 1].map(|edge| f64::from(edge) / f64::from(found.bins.get()));
        out.by_visible_fraction.push(RankedBin { visible_fraction, ranked: of(&in_bin, &every) });
    }
    for zone in Zone::ALL {
        let in_zone = |tree: &DetectRecord, f: &FruitSeen| {
            counts(tree, f) && hanging(tree, f.fruit).is_some_and(|fruit| fruit.zone == Some(zone))
        };
        let beside = |tree: &DetectRecord, p: &Vec3| {
            tree.zone_frame.as_ref().is_some_and(|frame| frame.zone(p) == zone)
        };
        out.by_zone.insert(zone, of(&in_zone, &beside));
    }
    if let Some(widest) = radii.iter().copied().max_by(f64::total_cmp) {
        let ranking = rank(trees, &Choice { radii: widest, fruit: &counts, wrong: &every });
        out.calibration = calibration(&ranking, trees.len(), rules.score_bins.get(), resamples);
    }
    out
}

fn average_precision(ranking: &Ranking, trees: usize, resamples: &Resamples) -> Spread {
    let of_trees = |drawn: &[usize]| {
        let mut times = vec![0; trees];
        drawn.iter().for_each(|&tree| times[tree] += 1);
        ranking.average_precision(&times)
    };
    Spread {
        value: ranking.average_precision(&vec![1; trees]),
        ci95: interval_ends(resamples.interval_of(of_trees).ok()),
        n: ranking.positives(),
    }
}

fn calibration(ranking: &Ranking, trees: usize, bins: u32, resamples: &Resamples) -> Calibration {
    let mut squares = vec![Share::default(); trees];
    for p in ranking.predictions() {
        let error = p.score - f64::from(u8::from(p.right));
        squares[p.tree] = squares[p.tree] + Share::of_one(error * error);
    }
    let bins = ranking.reliability(bins);
    Calibration {
        brier: Metric::of(&squares, resamples),
        expected_error: expected_calibration_error(&bins),
        bins,
    }
}

fn rank(trees: &[(&DetectRecord, Option<&DensityRecord>)], choice: &Choice<'_>) -> Ranking {
    let mut predictions = Vec::new();
    let mut positives = vec![0; trees.len()];
    for (number, (tree, density)) in trees.iter().enumerate() {
        for image in density.iter().flat_map(|density| &density.images) {
            positives[number] += image.fruit.iter().filter(|f| (choice.fruit)(tree, f)).count() as u32;
            let judged = judge(tree, image, choice);
            predictions.extend(judged.into_iter().map(|(score, right)| Prediction {
                score,
                right,
                tree: number,
            }));
        }
    }
    Ranking::new(predictions, positives)
}

/// Score and verdict of the spheres of an image that count.
fn judge(tree: &DetectRecord, image: &ImageRecord, choice: &Choice<'_>) -> Vec<(f64, bool)> {
    let mut spheres: Vec<Sphere> = image.detections.iter().map(|d| (d.score, d.p_world.into())).collect();
    spheres.extend(image.below_threshold.iter().map(|s| (s.score, Vec3::from(s.p_world))));
    // The sort is stable: equal scores stay in the detector's order.
    spheres.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut found = BTreeSet::new();
    let mut verdicts = Vec::new();
    for (score, p_world) in spheres {
        let near = nearest(tree, &p_world).and_then(|(fruit, radii)| {
            let seen = image.fruit.iter().find(|seen| seen.fruit == fruit.id)?;
            Some((seen, radii))
        });
        match near {
            Some((seen, _)) if !(choice.fruit)(tree, seen) => {}
            Some((seen, radii)) if radii <= choice.radii && found.insert(seen.fruit) => {
                verdicts.push((score, true));
            }
            _ if (choice.wrong)(tree, &p_world) => verdicts.push((score, false)),
            _ => {}
        }
    }
    verdicts
}

/// Fruit within one radius of a point, and its distance \[radii\]. Apples do not interpenetrate, so there is one at most.
fn nearest<'a>(tree: &'a DetectRecord, p_world: &Vec3) -> Option<(&'a HangingFruit, f64)> {
    let distance =
        |fruit: &'a HangingFruit| (fruit, (p_world - Vec3::from(fruit.p_world)).norm() / fruit.radius);
    tree.fruit.iter().map(distance).filter(|(_, radii)| *radii <= 1.0).min_by(|a, b| a.1.total_cmp(&b.1))
}

fn hanging(tree: &DetectRecord, id: u32) -> Option<&HangingFruit> {
    tree.fruit.get(id as usize).filter(|fruit| fruit.id == id)
}

#[cfg(test)]
#[path = "ranking_tests.rs"]
mod tests;
