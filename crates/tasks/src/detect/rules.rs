//! The detection task's constants: `[detect]` of `configs/bench/v1.toml`.

use std::collections::BTreeMap;

use orchard_quantity::{Count, Quantity, Span};
use serde::{Deserialize, Serialize};

use crate::vantage::VantageSpec;

/// The detection task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectRules {
    /// Views per tree.
    pub views: Count,
    /// Distribution of the views.
    pub vantage: VantageSpec,
    /// Rules for the fruit that should be found.
    pub found: FoundRules,
    /// Detections ranked by their score.
    pub ranking: RankingRules,
    /// The gate ablation.
    pub ablation: AblationRules,
    /// The paper's figures of the foliage sweep, by metric.
    pub published: BTreeMap<String, Vec<FoliageFigure>>,
    /// Requirements on the detector over the tuning seeds, by metric: smallest values; for errors, largest values.
    pub required: BTreeMap<String, Vec<FoliageFigure>>,
}

/// Rules for the fruit in an image that the detector should find: it meets all of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoundRules {
    /// Smallest visible fraction.
    pub visible_fraction: Quantity,
    /// Depth of the centre.
    pub depth: Span,
    /// Smallest number of visible pixels.
    pub pixels: Count,
    /// Number of equal bins of the visible fraction.
    pub bins: Count,
}

/// Detections ranked by their score.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RankingRules {
    /// Largest distances between the centres of a right detection and its fruit, in the fruit's radii.
    pub radii: Vec<Quantity>,
    /// Least score of a sphere that is ranked.
    pub least_score: Quantity,
    /// Steps of the recall at which the precision-recall curve is told.
    pub steps: Count,
    /// Bins of the score.
    pub score_bins: Count,
}

/// The gate ablation: the views of the first seed's trees at one density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AblationRules {
    /// The density, one of those of the sweep.
    pub foliage: Quantity,
    /// The paper's figures, by variant.
    pub published: BTreeMap<String, PublishedVariant>,
}

/// The paper's figures of one variant of the ablation; for comparison only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedVariant {
    /// False positives on wood in 48 views.
    pub wood: u32,
    /// Precision.
    pub precision: f64,
    /// Change of the single-view recall against the variant without anti-branch gates.
    pub recall_change: f64,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
}

/// A figure at one foliage density; for comparison only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoliageFigure {
    /// The density.
    pub foliage: f64,
    /// The figure.
    pub value: f64,
    /// Unit.
    pub unit: String,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
}

impl DetectRules {
    /// Returns a conflict with the foliage densities of the sweep, as (field, problem).
    pub(crate) fn problem(&self, densities: &[f64]) -> Option<(&'static str, String)> {
        let foliage = self.ablation.foliage.si();
        (!densities.contains(&foliage))
            .then(|| ("detect.ablation.foliage", format!("value {foliage} is not in sweeps.foliage")))
    }
}
