//! `detect.json`: the metrics of a run, by foliage density, and the gate ablation.

use std::collections::BTreeMap;

use orchard_bench::record::Record;
use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_scenario::SceneNames;
use orchard_spec::camera::CameraSpec;
use orchard_statistics::Resamples;
use orchard_statistics::{Metric, estimate};
use serde::{Deserialize, Serialize};

use crate::detect::ablation::variants;
use crate::detect::metrics::METRICS;
use crate::detect::plan::DetectPlan;
use crate::detect::ranking::{RankingSummary, ranked};
use crate::detect::record::{DensityRecord, DetectRecord, SitsOn};
use crate::detect::spread::{Spread, radius_correlation, spreads};
use crate::detect::tally::{Found, Tally, ZoneTally};
use crate::seeds::SeedSetLabel;
use crate::zones::{ZoneTable, zone_table};

/// A whole run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DetectSummary {
    /// Layout version.
    pub schema_version: u32,
    /// Code version.
    pub code_version: String,
    /// SHA-256 of all config texts.
    pub config_hash: String,
    /// Preset of the trees.
    pub preset: String,
    /// Names of the trees, the camera and the detector.
    pub scene: SceneNames,
    /// Profile.
    pub profile: String,
    /// Version of protocol and configs.
    pub config_version: String,
    /// Seed set.
    pub seed_set: SeedSetLabel,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// The camera, with all its figures.
    pub camera: CameraSpec,
    /// Name of the detector's config.
    pub detector: String,
    /// One entry per tree.
    pub trees: Vec<TreeLine>,
    /// Number of trees that could not be imaged; they are in no other metric.
    pub quarantined: u32,
    /// Results by ascending foliage density.
    pub densities: Vec<DensitySummary>,
    /// The gate ablation.
    pub ablation: AblationSummary,
}

/// Summary of a tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TreeLine {
    /// File under the result folder.
    pub file: String,
    /// Seed.
    pub seed: u64,
    /// World index.
    pub world: u32,
    /// Fruit on the tree.
    pub fruit: u32,
    /// Reason why it could not be imaged, if so.
    pub quarantined: Option<String>,
}

/// Results at one foliage density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DensitySummary {
    /// The density.
    pub foliage: f64,
    /// Leaves, summed over trees.
    pub leaves: u32,
    /// Results of the unchanged detector.
    #[serde(flatten)]
    pub results: VariantSummary,
    /// Correlation between detected and true radii of true positives.
    pub radius_correlation: Spread,
    /// Detections ranked by their score: average precision (`ap`) and the like.
    #[serde(flatten)]
    pub ranking: RankingSummary,
    /// Recall over fruit in range by visible fraction.
    pub recall_by_visible_fraction: Vec<FractionBin>,
    /// Results by canopy zone, pooled over trees.
    pub zones: ZoneTable<ZoneSummary>,
}

/// Results of one detector on a set of images.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VariantSummary {
    /// Images.
    pub images: u32,
    /// Detections.
    pub detections: u32,
    /// Detections that are matched to a fruit.
    pub true_positives: u32,
    /// False positives by the object that they sit on.
    pub false_positives: BTreeMap<SitsOn, u32>,
    /// Estimates by name.
    pub metrics: BTreeMap<String, Metric>,
    /// Quantiles of errors by name.
    pub errors: BTreeMap<String, Spread>,
}

/// A bin of the visible fraction; the upper end is excluded, except in the last bin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FractionBin {
    /// Ends.
    pub visible_fraction: [f64; 2],
    /// Fruit in range with a visible pixel, summed over images.
    pub fruit: u32,
    /// Of this fruit, found.
    pub found: u32,
    /// Found over fruit; null without fruit.
    pub recall: Option<f64>,
}

/// One zone, pooled over trees.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ZoneSummary {
    /// Detections in the zone.
    pub detections: u32,
    /// Of these, matched to a fruit.
    pub true_positives: u32,
    /// Their ratio; null without detections.
    pub precision: Option<f64>,
    /// Fruit of the zone that should be found, summed over images.
    #[serde(rename = "ought")]
    pub expected: u32,
    /// Of this fruit, found.
    pub found: u32,
    /// Their ratio; null without such fruit.
    pub recall: Option<f64>,
}

/// The gate ablation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AblationSummary {
    /// The foliage density.
    pub foliage: f64,
    /// Seed of the trees.
    pub seed: Option<u64>,
    /// Results by name of the variant.
    pub variants: BTreeMap<String, VariantSummary>,
}

impl DetectSummary {
    /// File under the result folder.
    pub const FILE: &'static str = "detect.json";

    /// Sums up the trees of a plan, given in the order of [`DetectPlan::keys`].
    pub fn of_run(plan: &DetectPlan, trees: &[DetectRecord]) -> Self {
        let seen: Vec<&DetectRecord> = trees.iter().filter(|tree| tree.quarantined.is_none()).collect();
        Self {
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            config_hash: plan.config_hash(),
            preset: plan.scene.preset.clone(),
            scene: plan.scene.clone(),
            profile: plan.profile.clone(),
            config_version: plan.protocol.version.clone(),
            seed_set: plan.protocol.label(&plan.seeds, plan.trees),
            seeds: plan.seeds.clone(),
            camera: plan.camera.clone(),
            detector: plan.scene.detector.clone(),
            trees: trees.iter().map(line).collect(),
            quarantined: (trees.len() - seen.len()) as u32,
            densities: plan
                .protocol
                .densities()
                .into_iter()
                .map(|foliage| density(plan, &seen, foliage))
                .collect(),
            ablation: ablation(plan, &seen),
        }
    }

    /// Results at a density, if it is in the run.
    pub fn at(&self, foliage: f64) -> Option<&DensitySummary> {
        self.densities.iter().find(|density| density.foliage == foliage)
    }
}

/// A tree at one density.
fn density_of(tree: &DetectRecord, foliage: f64) -> Option<&DensityRecord> {
    tree.densities.iter().find(|record| record.foliage == foliage)
}

fn line(tree: &DetectRecord) -> TreeLine {
    TreeLine {
        file: DetectRecord::path(&tree.key),
        seed: tree.key.seed,
        world: tree.key.world,
        fruit: tree.fruit.len() as u32,
        quarantined: tree.quarantined.clone(),
    }
}

/// Resamples of trees, by their seeds.
fn resamples(plan: &DetectPlan, trees: &[&DetectRecord]) -> Resamples {
    let of_seed = |seed: &u64| (0..trees.len()).filter(|&i| trees[i].key.seed == *seed).collect();
    let groups: Vec<Vec<usize>> = plan.seeds.iter().map(of_seed).collect();
    Resamples::draw(&groups, &plan.protocol.bootstrap)
}

fn density(plan: &DetectPlan, trees: &[&DetectRecord], foliage: f64) -> DensitySummary {
    let bins = plan.protocol.detect.found.bins.get();
    let tally = |tree: &&DetectRecord| match density_of(tree, foliage) {
        None => Tally::nothing(bins),
        Some(DensityRecord { images, tracks, .. }) => {
            let images = images.iter().map(|image| (&image.fruit[..], &image.detections[..]));
            Tally::of(tree, images, tracks, bins)
        }
    };
    let tallies: Vec<Tally> = trees.iter().map(tally).collect();
    let of_density: Vec<_> = trees.iter().map(|&tree| (tree, density_of(tree, foliage))).collect();
    let leaves = of_density.iter().filter_map(|(_, density)| *density).map(|record| record.leaves).sum();
    let resamples = resamples(plan, trees);
    DensitySummary {
        foliage,
        leaves,
        results: results(&tallies, &resamples),
        radius_correlation: radius_correlation(&tallies, &resamples),
        ranking: ranked(plan, &of_density, &resamples),
        recall_by_visible_fraction: fraction_bins(&tallies, bins),
        zones: zones(&tallies),
    }
}

fn ablation(plan: &DetectPlan, trees: &[&DetectRecord]) -> AblationSummary {
    let rules = &plan.protocol.detect;
    let foliage = rules.ablation.foliage.si();
    let trees: Vec<&DetectRecord> = trees.iter().copied().filter(|tree| tree.key.ablation).collect();
    let resamples = resamples(plan, &trees);
    let summary = |name: &str| {
        let tally = |tree: &&DetectRecord| {
            let density = density_of(tree, foliage)?;
            let variant = tree.variants.iter().find(|record| record.variant == name)?;
            let fruit = density.images.iter().map(|image| &image.fruit[..]);
            let images = fruit.zip(variant.images.iter().map(|detections| &detections[..]));
            Some(Tally::of(tree, images, &[], rules.found.bins.get()))
        };
        let nothing = || Tally::nothing(rules.found.bins.get());
        let tallies: Vec<Tally> = trees.iter().map(|tree| tally(tree).unwrap_or_else(nothing)).collect();
        results(&tallies, &resamples)
    };
    AblationSummary {
        foliage,
        seed: plan.seeds.first().copied(),
        variants: variants(&plan.detector)
            .iter()
            .map(|variant| (variant.name.to_owned(), summary(variant.name)))
            .collect(),
    }
}

fn results(trees: &[Tally], resamples: &Resamples) -> VariantSummary {
    let sum = |count: fn(&Tally) -> u32| trees.iter().map(count).sum();
    let mut false_positives = BTreeMap::new();
    for (on, n) in trees.iter().flat_map(|tally| &tally.false_positives) {
        *false_positives.entry(*on).or_default() += n;
    }
    VariantSummary {
        images: sum(|t| t.images),
        detections: sum(|t| t.detections),
        true_positives: sum(|t| t.true_positives),
        false_positives,
        metrics: estimate(METRICS, trees, resamples),
        errors: spreads(trees, resamples),
    }
}

fn fraction_bins(trees: &[Tally], bins: u32) -> Vec<FractionBin> {
    let bin = |i: u32| {
        let mut sum = Found::default();
        trees.iter().for_each(|tally| sum.add(tally.bins[i as usize]));
        FractionBin {
            visible_fraction: [i, i + 1].map(|edge| f64::from(edge) / f64::from(bins)),
            fruit: sum.of,
            found: sum.found,
            recall: rate(sum),
        }
    };
    (0..bins).map(bin).collect()
}

fn zones(trees: &[Tally]) -> ZoneTable<ZoneSummary> {
    let mut sums = zone_table(ZoneTally::default());
    for (zone, tally) in trees.iter().flat_map(|tally| &tally.zones) {
        let sum = sums.entry(*zone).or_default();
        sum.detections.add(tally.detections);
        sum.expected.add(tally.expected);
    }
    let summary = |ZoneTally { detections, expected }| ZoneSummary {
        detections: detections.of,
        true_positives: detections.found,
        precision: rate(detections),
        expected: expected.of,
        found: expected.found,
        recall: rate(expected),
    };
    sums.into_iter().map(|(zone, sum)| (zone, summary(sum))).collect()
}

fn rate(found: Found) -> Option<f64> {
    (found.of > 0).then(|| f64::from(found.found) / f64::from(found.of))
}
