//! Runs every tree of a plan, in parallel, into a result folder.

use std::sync::atomic::{AtomicBool, Ordering};

use orchard_bench::PlanError;
use orchard_bench::store::StoreError;
use orchard_bench::task::{Progress, RunError, Session, Task, TaskResult, run_task};
use orchard_camera::picture::{PictureStyle, Studio};
use orchard_camera::{Geometry, ImageKey, Label, Scene, Sensor};
use orchard_geometry::{Pose, Vec3, transform};
use orchard_perception::{Detection, DetectorConfig, PerceptionError, Sighting, Tracker};

use crate::detect::ablation::variants;
use crate::detect::image::View;
use crate::detect::plan::{DetectKey, DetectPlan};
use crate::detect::record::{
    DensityRecord, DetectRecord, DetectionRecord, HangingFruit, ImageRecord, ScoredSphere, TrackRecord,
    VariantRecord,
};
use crate::detect::score::{fruit_seen, score};
use crate::detect::summary::DetectSummary;
use crate::detect::trees::{RestingTree, Trees};
use crate::json::array;
use crate::matching::{Ball, match_detections};
use crate::vantage::vantages;
use crate::zones::ZoneFrame;

/// A finished run.
pub type DetectResult = TaskResult<DetectRecord, DetectSummary>;

/// Runs a session's part of a plan: writes `detect/*.json`, `compute.json`, and for a whole run `detect.json`.
///
/// # Errors
/// The plan is invalid, the folder holds records of another plan, a file cannot be written, or `stop` was raised.
pub fn run(
    plan: &DetectPlan,
    trees: &impl Trees,
    session: &Session<'_>,
    progress: &impl Progress<DetectRecord>,
) -> Result<DetectResult, RunError> {
    run_task(&Views::new(plan, trees), session, progress)
}

/// The detection task: the views of every tree of a plan.
pub struct Views<'a, T> {
    plan: &'a DetectPlan,
    trees: &'a T,
    sensor: Sensor,
}

impl<'a, T> Views<'a, T> {
    /// Builds the task of a plan.
    pub fn new(plan: &'a DetectPlan, trees: &'a T) -> Self {
        Self { plan, trees, sensor: Sensor::new(&plan.camera) }
    }
}

/// Truth of a tree that is the same at all densities.
struct SharedTruth {
    fruit: Vec<Ball>,
    zones: Option<ZoneFrame>,
    x_world_camera: Vec<Pose>,
}

/// Reason why a tree has no images.
enum NoRecord {
    Stopped,
    Quarantined(String),
}

impl From<PerceptionError> for NoRecord {
    fn from(e: PerceptionError) -> Self {
        NoRecord::Quarantined(e.to_string())
    }
}

impl<T: Trees> Task for Views<'_, T> {
    type Record = DetectRecord;
    type Summary = DetectSummary;
    const NAME: &'static str = "detect";
    const SUMMARY: &'static str = DetectSummary::FILE;

    fn check(&self) -> Result<(), PlanError> {
        self.plan.check()
    }

    fn keys(&self) -> Vec<DetectKey> {
        self.plan.keys()
    }

    fn compute(
        &self,
        key: &DetectKey,
        stop: &AtomicBool,
        on_step: &mut dyn FnMut(),
    ) -> Result<Option<DetectRecord>, StoreError> {
        Ok(match self.record(key, stop, on_step) {
            Ok(record) => Some(record),
            Err(NoRecord::Quarantined(reason)) => Some(DetectRecord::never_seen(key.clone(), reason)),
            Err(NoRecord::Stopped) => None,
        })
    }

    fn steps(&self, record: &DetectRecord) -> u64 {
        self.plan.steps(&record.key)
    }

    /// The tree is at rest.
    fn frame(&self) -> f64 {
        0.0
    }

    fn sum_up(&self, records: &[DetectRecord]) -> DetectSummary {
        DetectSummary::of_run(self.plan, records)
    }
}

impl<T: Trees> Views<'_, T> {
    fn record(
        &self,
        key: &DetectKey,
        stop: &AtomicBool,
        on_step: &mut dyn FnMut(),
    ) -> Result<DetectRecord, NoRecord> {
        let rules = &self.plan.protocol.detect;
        let mut step = || {
            on_step();
            if stop.load(Ordering::Relaxed) { Err(NoRecord::Stopped) } else { Ok(()) }
        };
        let mut first: Option<(RestingTree, SharedTruth)> = None;
        let mut densities = Vec::new();
        let mut records = Vec::new();
        for foliage in self.plan.protocol.densities() {
            let tree = self.trees.tree(key.seed, key.world, foliage).map_err(NoRecord::Quarantined)?;
            let stand = self.stand(key, &tree);
            if let Some((bare, there)) = &first
                && !(same_but_for_leaves(bare, &tree) && there.x_world_camera == stand.x_world_camera)
            {
                return Err(NoRecord::Quarantined(format!(
                    "wood, fruit or views differ at foliage {foliage}"
                )));
            }
            let margin = self.plan.detector.mask.ground_margin.si();
            let style = PictureStyle::of_camera().under(self.plan.light.as_ref());
            let studio = self.plan.detector.sees_colour().then(|| Studio::new(&tree.picture, &style));
            // A view has the same noise at every density.
            let image = |(number, x): (u32, &Pose)| {
                let noise = ImageKey { seed: key.seed, world: key.world, frame: number };
                View::take(&self.sensor, (&tree.scene, studio.as_ref()), x, noise, margin)
            };
            let views: Vec<View> = (0..).zip(&stand.x_world_camera).map(image).collect();
            densities.push(self.density(foliage, &tree.scene, &views, &stand, &mut step)?);
            if key.ablation && foliage == rules.ablation.foliage.si() {
                for variant in variants(&self.plan.detector) {
                    let detections = |view| {
                        step()?;
                        Ok(detections(view, &variant.config, &stand)?)
                    };
                    let images = views.iter().map(detections).collect::<Result<_, NoRecord>>()?;
                    records.push(VariantRecord { variant: variant.name.to_owned(), images });
                }
            }
            first.get_or_insert((tree, stand));
        }
        let Some((_, SharedTruth { fruit, zones, .. })) = first else {
            return Err(NoRecord::Quarantined("no foliage density".to_owned()));
        };
        let hanging = |(id, ball): (u32, &Ball)| HangingFruit {
            id,
            p_world: array(&ball.p_world),
            radius: ball.radius,
            zone: zones.as_ref().map(|frame| frame.zone(&ball.p_world)),
        };
        let fruit = (0..).zip(&fruit).map(hanging).collect();
        let key = key.clone();
        Ok(DetectRecord { key, quarantined: None, zone_frame: zones, fruit, densities, variants: records })
    }

    fn stand(&self, key: &DetectKey, tree: &RestingTree) -> SharedTruth {
        let rules = &self.plan.protocol.detect;
        let reachable: Vec<Vec3> =
            tree.fruit.iter().zip(&tree.reachable).filter(|(_, r)| **r).map(|(f, _)| f.p_world).collect();
        SharedTruth {
            fruit: tree.fruit.iter().map(|f| Ball { p_world: f.p_world, radius: f.radius }).collect(),
            zones: ZoneFrame::calibrate(&reachable, &self.plan.protocol.zones),
            x_world_camera: vantages(&rules.vantage, &tree.scene, key.seed, key.world, rules.views.get()),
        }
    }

    fn density(
        &self,
        foliage: f64,
        scene: &Scene,
        views: &[View],
        stand: &SharedTruth,
        step: &mut impl FnMut() -> Result<(), NoRecord>,
    ) -> Result<DensityRecord, NoRecord> {
        let mut images = Vec::new();
        for view in views {
            step()?;
            let r = view.x_world_camera.rotation.coords;
            let least = self.plan.protocol.detect.ranking.least_score.si();
            let (detections, refused) = view.sight.ranked(&self.plan.detector, least)?;
            let below = |d: &Detection| ScoredSphere {
                p_world: array(&transform(&view.x_world_camera, &d.p_camera)),
                radius: d.radius,
                score: d.score,
            };
            images.push(ImageRecord {
                p_world_camera: array(&view.x_world_camera.translation.vector),
                r_world_camera: [r.x, r.y, r.z, r.w],
                fruit: fruit_seen(&view.fruit, &self.plan.protocol.detect.found),
                detections: score(view, &detections, &stand.fruit, stand.zones.as_ref()),
                below_threshold: refused.iter().map(below).collect(),
            });
        }
        let leaves = scene.items.iter().filter(|item| item.label == Label::Leaf).count() as u32;
        let tracks = tracks(&images, &self.plan.detector, &stand.fruit);
        Ok(DensityRecord { foliage, leaves, images, tracks })
    }
}

/// Detections in an image, scored against the truth.
fn detections(
    view: &View,
    config: &DetectorConfig,
    stand: &SharedTruth,
) -> Result<Vec<DetectionRecord>, PerceptionError> {
    Ok(score(view, &view.sight.detect(config)?, &stand.fruit, stand.zones.as_ref()))
}

/// Tracks over all images of a tree. All images have the same time, so no track expires.
fn tracks(images: &[ImageRecord], config: &DetectorConfig, fruit: &[Ball]) -> Vec<TrackRecord> {
    let mut tracker = Tracker::new(config);
    for image in images {
        let sighting =
            |d: &DetectionRecord| Sighting { p_odom: d.p_world.into(), radius: d.radius, score: d.score };
        let sightings: Vec<Sighting> = image.detections.iter().map(sighting).collect();
        tracker.update(0.0, &sightings);
    }
    let p_world: Vec<Vec3> = tracker.tracks().iter().map(|t| t.p_odom).collect();
    let matched = match_detections(&p_world, fruit);
    let record = |(track, fruit): (&orchard_perception::Track, Option<usize>)| TrackRecord {
        p_world: array(&track.p_odom),
        radius: track.radius,
        hits: track.hits,
        confirmed: track.confirmed,
        fruit: fruit.map(|f| f as u32),
    };
    tracker.tracks().iter().zip(matched).map(record).collect()
}

/// True if two trees have the same solids at the same poses, bit for bit, except leaves.
fn same_but_for_leaves(a: &RestingTree, b: &RestingTree) -> bool {
    let solids = |tree: &'_ RestingTree| -> Vec<_> {
        let solid = |item: &&orchard_camera::Item| !matches!(item.geometry, Geometry::Blade { .. });
        tree.scene.items.iter().filter(solid).cloned().collect()
    };
    a.fruit == b.fruit && a.reachable == b.reachable && solids(a) == solids(b)
}
