//! Test fixtures: trees of a few balls, and hand-made records.

use orchard_camera::{Geometry, Label, NO_INSTANCE, Scene, blade::BladeMesh};
use orchard_geometry::{Pose, Shape, Vec3};
use orchard_perception::DetectorConfig;
use orchard_scenario::SceneNames;
use orchard_spec::{Purpose, Spec, Stream};
use orchard_world::truth::{FruitState, FruitTruth};
use std::sync::Arc;

use crate::detect::plan::{DetectKey, DetectPlan};
use crate::detect::record::{DensityRecord, DetectRecord, DetectionRecord, FruitSeen, HangingFruit, SitsOn};
use crate::detect::trees::{RestingTree, Trees};
use crate::protocol::Protocol;
use crate::zones::Zone;

/// A trunk with apples round it, and leaves before some of them. World 2 of every seed cannot be built.
pub struct FakeTrees {
    /// The label of the apples, whose form does not change with it.
    pub fruit_label: Label,
    /// Displacement of the fruit with the density \[m\].
    pub moved: f64,
}

impl FakeTrees {
    pub fn new() -> Self {
        Self { fruit_label: Label::Fruit, moved: 0.0 }
    }
}

impl Trees for FakeTrees {
    fn tree(&self, seed: u64, world: u32, foliage: f64) -> Result<RestingTree, String> {
        if world == 2 {
            return Err("no static equilibrium".into());
        }
        let mut stream = Stream::new(seed, world, Purpose::Test);
        let mut scene = Scene::default();
        scene.push(Geometry::Shape(Shape::HalfSpace), Pose::identity(), Label::Ground, NO_INSTANCE);
        // Thicker than any apple, or its round end would be one.
        let trunk = Shape::Capsule { radius: 0.08, length: 1.6 };
        scene.push(Geometry::Shape(trunk), Pose::identity(), Label::Wood, 0);
        let mesh = Arc::new(BladeMesh::new(0.35, 0.7));
        let mut fruit = Vec::new();
        for i in 0..8 {
            let bearing = f64::from(i) * std::f64::consts::FRAC_PI_4;
            let (sin, cos) = orchard_geometry::math::sin_cos(bearing);
            let distance = stream.uniform(0.15, 0.35);
            let height = stream.uniform(0.8, 1.4) + self.moved * foliage;
            let p_world = Vec3::new(distance * cos, distance * sin, height);
            let radius = stream.uniform(0.03, 0.04);
            let x = Pose::from_parts(p_world.into(), orchard_geometry::Rotation::identity());
            scene.push(Geometry::Shape(Shape::Sphere { radius }), x, self.fruit_label, i);
            fruit.push(FruitTruth { p_world, radius, state: FruitState::OnTree });
            for k in 0..(4.0 * foliage) as u32 {
                let beside = Vec3::new(0.05 * cos, 0.05 * sin, 0.02 * f64::from(k) - 0.03);
                let leaf =
                    Pose::from_parts((p_world + beside).into(), orchard_geometry::Rotation::identity());
                scene.push(
                    Geometry::Blade { mesh: mesh.clone(), length: 0.08, width: 0.05 },
                    leaf,
                    Label::Leaf,
                    k,
                );
            }
        }
        let reachable = vec![true; fruit.len()];
        Ok(RestingTree { picture: scene.clone(), scene, fruit, reachable })
    }
}

/// A plan of 2 seeds x 3 fake trees x 2 views.
pub fn plan() -> DetectPlan {
    let mut protocol = Protocol::paper();
    protocol.detect.views = protocol.detect.views.with_value(2).unwrap();
    DetectPlan {
        scene: SceneNames { preset: "fake".into(), ..SceneNames::paper() },
        scene_hash: "hash".into(),
        profile: "quick".into(),
        seeds: vec![7, 8],
        trees: 3,
        camera: Spec::paper().camera,
        light: None,
        detector: DetectorConfig::paper(),
        protocol,
    }
}

/// The record of a tree at all densities of the plan, with fruit in these zones and nothing else.
pub fn record(key: &DetectKey, zones: &[Option<Zone>]) -> DetectRecord {
    let density = |foliage| DensityRecord { foliage, leaves: 3, images: Vec::new(), tracks: Vec::new() };
    let fruit = |(id, &zone)| HangingFruit { id, p_world: [0.1, 0.2, 1.0], radius: 0.03, zone };
    DetectRecord {
        key: key.clone(),
        quarantined: None,
        zone_frame: None,
        fruit: (0..).zip(zones).map(fruit).collect(),
        densities: plan().protocol.densities().into_iter().map(density).collect(),
        variants: Vec::new(),
    }
}

/// A fruit of which an image shows `visible_px` of `unoccluded_px` pixels.
pub fn seen(fruit: u32, visible_px: u32, unoccluded_px: u32, in_range: bool, expected: bool) -> FruitSeen {
    FruitSeen { fruit, visible_px, unoccluded_px, depth: 1.0, in_range, expected }
}

/// A true positive.
pub fn hit(fruit: u32, centre_error: f64, radius_error: f64, zone: Zone) -> DetectionRecord {
    DetectionRecord {
        fruit: Some(fruit),
        centre_error: Some(centre_error),
        radius_error: Some(radius_error),
        ..miss(SitsOn::Fruit, zone)
    }
}

/// A false positive.
pub fn miss(on: SitsOn, zone: Zone) -> DetectionRecord {
    DetectionRecord {
        p_world: [0.1, 0.2, 1.0],
        radius: 0.03,
        score: 0.5,
        rms: 1e-4,
        pixels: 20,
        fruit: None,
        centre_error: None,
        radius_error: None,
        on,
        zone: Some(zone),
    }
}
