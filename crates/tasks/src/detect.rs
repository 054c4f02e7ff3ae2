//! The detection task: single depth images of trees at rest by a free camera, at several foliage densities.
//!
//! trees -> views -> images -> detections -> scores -> records -> metrics -> summary. Trees, fruit and camera
//! poses are the same at every density. `docs/benchmark-v1.md` defines the figures.

mod ablation;
#[cfg(test)]
mod fake;
mod image;
mod metrics;
mod plan;
mod ranking;
mod record;
pub(crate) mod rules;
mod run;
mod score;
mod spread;
mod summary;
mod tally;
#[cfg(test)]
mod tests;
mod trees;

pub use ablation::{Variant, variants};
pub use metrics::METRICS;
pub use plan::{DetectKey, DetectPlan};
pub use ranking::{Calibration, RankedBin, RankedFruit, RankingSummary};
pub use record::{
    DensityRecord, DetectRecord, DetectionRecord, FruitSeen, HangingFruit, ImageRecord, ScoredSphere, SitsOn,
    TrackRecord, VariantRecord,
};
pub use rules::{AblationRules, DetectRules, FoliageFigure, FoundRules, PublishedVariant, RankingRules};
pub use run::{DetectResult, Views, run};
pub use spread::{ERRORS, Spread};
pub use summary::{AblationSummary, DensitySummary, DetectSummary, FractionBin, VariantSummary, ZoneSummary};
pub use trees::{RestingTree, Trees};
