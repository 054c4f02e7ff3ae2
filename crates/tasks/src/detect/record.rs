//! The record of one tree, as written to `detect/*.json`.

use orchard_bench::record::Record;
use serde::{Deserialize, Serialize};

use crate::detect::plan::DetectKey;
use crate::zones::{Zone, ZoneFrame};

/// One tree at every foliage density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DetectRecord {
    /// Key: all inputs that determine the record.
    #[serde(flatten)]
    pub key: DetectKey,
    /// Reason why the tree could not be imaged, if so.
    pub quarantined: Option<String>,
    /// Zone frame; null if no fruit is reachable.
    pub zone_frame: Option<ZoneFrame>,
    /// Every fruit, the same at all densities.
    pub fruit: Vec<HangingFruit>,
    /// Images, detections and tracks, by ascending density.
    pub densities: Vec<DensityRecord>,
    /// The ablation: detections of the detector's variants; empty if the key has no ablation.
    pub variants: Vec<VariantRecord>,
}

/// A fruit at rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HangingFruit {
    /// Index of the fruit in its world.
    pub id: u32,
    /// Centre \[m, world\].
    pub p_world: [f64; 3],
    /// Radius \[m\].
    pub radius: f64,
    /// Zone; null without a zone frame.
    pub zone: Option<Zone>,
}

/// A tree at one foliage density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DensityRecord {
    /// The density.
    pub foliage: f64,
    /// Leaves of the tree.
    pub leaves: u32,
    /// Images.
    pub images: Vec<ImageRecord>,
    /// Tracks over all images together, oldest first.
    pub tracks: Vec<TrackRecord>,
}

/// One image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImageRecord {
    /// Position of the lens \[m, world\].
    pub p_world_camera: [f64; 3],
    /// Orientation of the optical frame in the world, (x, y, z, w).
    pub r_world_camera: [f64; 4],
    /// Every fruit with a visible pixel, by index.
    pub fruit: Vec<FruitSeen>,
    /// Detections.
    pub detections: Vec<DetectionRecord>,
    /// Spheres that the score alone refused, down to the least score that is ranked ([`crate::detect::RankingRules`]).
    pub below_threshold: Vec<ScoredSphere>,
}

/// A fruit in an image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FruitSeen {
    /// Index of the fruit.
    pub fruit: u32,
    /// Visible pixels.
    pub visible_px: u32,
    /// Pixels that it would cover if nothing else existed.
    pub unoccluded_px: u32,
    /// Depth of its centre \[m\].
    pub depth: f64,
    /// True if that depth is in the range of [`crate::detect::FoundRules`].
    pub in_range: bool,
    /// True if the detector should find it ([`crate::detect::FoundRules`]).
    #[serde(rename = "ought")]
    pub expected: bool,
}

impl FruitSeen {
    /// Visible fraction: visible over unoccluded pixels.
    pub fn visible_fraction(&self) -> f64 {
        f64::from(self.visible_px) / f64::from(self.unoccluded_px.max(1))
    }

    /// Bin of the visible fraction, of so many equal ones; a fruit in full view belongs to the last.
    pub(crate) fn fraction_bin(&self, bins: u32) -> u32 {
        ((self.visible_fraction() * f64::from(bins)) as u32).min(bins.saturating_sub(1))
    }
}

/// A detection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DetectionRecord {
    /// Centre \[m, world\].
    pub p_world: [f64; 3],
    /// Radius \[m\].
    pub radius: f64,
    /// Probability that it is a fruit, by the detector.
    pub score: f64,
    /// Root mean square of the radial residual \[m\].
    pub rms: f64,
    /// Pixels that support it.
    pub pixels: u32,
    /// The fruit that it is matched to; null for a false positive.
    pub fruit: Option<u32>,
    /// Distance between the centres \[m\]; null for a false positive.
    pub centre_error: Option<f64>,
    /// Radius error, detected minus true \[m\]; null for a false positive.
    pub radius_error: Option<f64>,
    /// Object that most of its pixels show, by ground truth.
    pub on: SitsOn,
    /// Zone; null without a zone frame.
    pub zone: Option<Zone>,
}

/// A sphere that the score refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScoredSphere {
    /// Centre \[m, world\].
    pub p_world: [f64; 3],
    /// Radius \[m\].
    pub radius: f64,
    /// Score.
    pub score: f64,
}

/// Object that a detection sits on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SitsOn {
    /// An apple. For a false positive: the centre is off by more than the apple's radius.
    Fruit,
    /// A false positive on an apple that another detection is matched to.
    FruitAgain,
    /// A leaf.
    Leaf,
    /// A branch or the trunk.
    Wood,
    /// The robot.
    Robot,
    /// The ground.
    Ground,
    /// A post or a wire.
    Scenery,
    /// Nothing: the camera measured an object that does not exist.
    Nothing,
}

/// A track.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrackRecord {
    /// Centre \[m, world\].
    pub p_world: [f64; 3],
    /// Radius \[m\].
    pub radius: f64,
    /// Number of images with a sighting.
    pub hits: u32,
    /// True if it is confirmed by enough sightings.
    pub confirmed: bool,
    /// The fruit that it is matched to, one to one among all tracks.
    pub fruit: Option<u32>,
}

/// One variant of the detector on the images of the ablation's density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VariantRecord {
    /// Name of the variant.
    pub variant: String,
    /// Detections, by image.
    pub images: Vec<Vec<DetectionRecord>>,
}

impl Record for DetectRecord {
    type Key = DetectKey;

    const FOLDER: &'static str = "detect";

    fn key(&self) -> &DetectKey {
        &self.key
    }

    fn file(key: &DetectKey) -> String {
        format!("{}-{:03}.json", key.seed, key.world)
    }
}

impl DetectRecord {
    /// The record of a tree that could not be imaged: only the reason.
    pub(crate) fn never_seen(key: DetectKey, reason: String) -> Self {
        Self {
            key,
            quarantined: Some(reason),
            zone_frame: None,
            fruit: Vec::new(),
            densities: Vec::new(),
            variants: Vec::new(),
        }
    }
}
