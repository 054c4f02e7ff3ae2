//! Scores the detector against the truth of one image.
#![allow(dead_code)] // each user takes its part

use orchard_camera::{Frame, Geometry, Label, Scene, fruit_views, render};
use orchard_geometry::{Intrinsics, Pose, Shape, Vec3, inverse_transform};
use orchard_perception::{Detection, DetectorConfig, detect, mask};

/// Counts over images.
#[derive(Debug, Clone, Copy, Default)]
pub struct Score {
    /// Number of detections.
    pub reported: usize,
    /// Detections within one radius of a fruit, one to one.
    pub right: usize,
    /// Number of detectable fruit.
    pub visible: usize,
    /// Number of detectable fruit that were found.
    pub found: usize,
}

impl Score {
    pub fn precision(&self) -> f64 {
        self.right as f64 / self.reported.max(1) as f64
    }

    pub fn recall(&self) -> f64 {
        self.found as f64 / self.visible.max(1) as f64
    }
}

/// Fruit as (instance, centre in the camera frame, radius).
fn fruit(scene: &Scene, x_world_camera: &Pose) -> Vec<(u32, Vec3, f64)> {
    let of = |item: &orchard_camera::Item| match item.geometry {
        Geometry::Shape(Shape::Sphere { radius }) if item.label == Label::Fruit => Some((
            item.instance,
            inverse_transform(x_world_camera, &item.x_world_item.translation.vector),
            radius,
        )),
        _ => None,
    };
    scene.items.iter().filter_map(of).collect()
}

/// Nearest pairs first, one to one, within one radius of the fruit: detection -> fruit.
fn matches(detections: &[Detection], fruit: &[(u32, Vec3, f64)]) -> Vec<Option<u32>> {
    let mut pairs = Vec::new();
    for (d, detection) in detections.iter().enumerate() {
        for (f, (_, p, radius)) in fruit.iter().enumerate() {
            let distance = (detection.p_camera - p).norm();
            if distance <= *radius {
                pairs.push((distance, d, f));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut out = vec![None; detections.len()];
    let mut taken = vec![false; fruit.len()];
    for (_, d, f) in pairs {
        if out[d].is_none() && !taken[f] {
            out[d] = Some(fruit[f].0);
            taken[f] = true;
        }
    }
    out
}

/// Renders, masks, detects and adds to the score. A fruit is detectable if at least 40 % of it and 14
/// pixels are seen, with its centre in the working range.
pub fn add_image(
    score: &mut Score,
    scene: &Scene,
    k: &Intrinsics,
    x: &Pose,
    config: &DetectorConfig,
    disturb: impl FnOnce(&mut Frame),
) -> (Frame, Vec<Detection>) {
    let mut frame = Frame::new(k.width, k.height);
    render(scene, k, x, 0.3, 3.0, &mut frame);
    disturb(&mut frame);
    let mut ignore = robot_mask(scene, k, x, &frame, config);
    let up = x.rotation.inverse() * Vec3::z();
    let ground = mask::ground_mask(&frame.depth, k, &up, x.translation.z, config.mask.ground_margin.si());
    mask::add(&mut ignore, &ground);
    let detections = detect(&frame.depth, k, Some(&ignore), config).unwrap();
    let fruit = fruit(scene, x);
    let matched = matches(&detections, &fruit);
    score.reported += detections.len();
    score.right += matched.iter().flatten().count();
    let range = config.segmentation.range.si();
    let min_pixels = config.segmentation.min_pixels.get();
    for (seen, (instance, p, _)) in fruit_views(&frame, scene, k, x).iter().zip(&fruit) {
        let enough = seen.visible_px >= min_pixels && 5 * seen.visible_px >= 2 * seen.unoccluded_px;
        if enough && (range.0..=range.1).contains(&p.z) {
            score.visible += 1;
            score.found += usize::from(matched.contains(&Some(*instance)));
        }
    }
    (frame, detections)
}

fn robot_mask(
    scene: &Scene,
    k: &Intrinsics,
    x: &Pose,
    frame: &Frame,
    config: &DetectorConfig,
) -> orchard_geometry::Image<bool> {
    let part = |item: &orchard_camera::Item| match &item.geometry {
        Geometry::Shape(shape) if item.label == Label::Robot => {
            Some((shape.clone(), x.inverse() * item.x_world_item))
        }
        _ => None,
    };
    let parts: Vec<_> = scene.items.iter().filter_map(part).collect();
    mask::self_mask(&frame.depth, k, &parts, config.mask.robot_margin.si())
}

/// Camera poses on a circle around the canopy.
pub fn vantages(count: usize) -> impl Iterator<Item = Pose> {
    (0..count).map(move |i| {
        let angle = std::f64::consts::TAU * i as f64 / count as f64;
        let (sin, cos) = orchard_geometry::math::sin_cos(angle);
        let distance = 0.95 + 0.15 * (i % 3) as f64;
        let height = 0.8 + 0.25 * (i % 4) as f64;
        let target = Vec3::new(0.0, 0.0, 0.3 + 0.6 * height);
        orchard_camera::picture::look_at(&Vec3::new(distance * cos, distance * sin, height), &target)
    })
}
