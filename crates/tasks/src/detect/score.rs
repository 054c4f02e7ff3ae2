//! Compares the detections of one image with the ground truth.

use std::collections::BTreeMap;

use orchard_camera::{FruitView, Label};
use orchard_geometry::{Vec3, transform};
use orchard_perception::Detection;

use crate::detect::image::View;
use crate::detect::record::{DetectionRecord, FruitSeen, SitsOn};
use crate::detect::rules::FoundRules;
use crate::json::array;
use crate::matching::{Ball, match_detections};
use crate::zones::ZoneFrame;

/// Every fruit with a visible pixel.
pub(crate) fn fruit_seen(views: &[FruitView], rules: &FoundRules) -> Vec<FruitSeen> {
    let seen = |view: &FruitView| {
        let in_range = rules.depth.contains_si(view.p_camera.z);
        FruitSeen {
            fruit: view.instance,
            visible_px: view.visible_px,
            unoccluded_px: view.unoccluded_px,
            depth: view.p_camera.z,
            in_range,
            expected: in_range
                && view.visible_fraction() >= rules.visible_fraction.si()
                && view.visible_px >= rules.pixels.get(),
        }
    };
    views.iter().filter(|view| view.visible_px > 0).map(seen).collect()
}

/// Matches the detections of an image to the tree's fruit and finds the object that each sits on.
pub(crate) fn score(
    view: &View,
    detections: &[Detection],
    fruit: &[Ball],
    zones: Option<&ZoneFrame>,
) -> Vec<DetectionRecord> {
    let p_world: Vec<Vec3> =
        detections.iter().map(|d| transform(&view.x_world_camera, &d.p_camera)).collect();
    let matched = match_detections(&p_world, fruit);
    let record = |i: usize| {
        let (detection, p_world) = (&detections[i], &p_world[i]);
        let truth = matched[i].map(|f| &fruit[f]);
        DetectionRecord {
            p_world: array(p_world),
            radius: detection.radius,
            score: detection.score,
            rms: detection.rms,
            pixels: detection.pixels,
            fruit: matched[i].map(|f| f as u32),
            centre_error: truth.map(|ball| (p_world - ball.p_world).norm()),
            radius_error: truth.map(|ball| detection.radius - ball.radius),
            on: match surface(view, detection) {
                (Label::Fruit, Some(f)) if matched[i].is_none() && matched.contains(&Some(f as usize)) => {
                    SitsOn::FruitAgain
                }
                (label, _) => label.into(),
            },
            zone: zones.map(|frame| frame.zone(p_world)),
        }
    };
    (0..detections.len()).map(record).collect()
}

/// Most frequent true label of a detection's pixels, and the index of the fruit if it is one. The pixels are those measured nearest to
/// its sphere, as many as the detection has.
fn surface(view: &View, detection: &Detection) -> (Label, Option<u32>) {
    let sight = &view.sight;
    let k = &sight.intrinsics;
    let Detection { p_camera, radius, .. } = detection;
    let Some((u, v)) = k.project(p_camera) else { return (Label::None, None) };
    // The silhouette of a sphere off the axis is a little wider than R f / z: take the nearest depth.
    let reach = radius / (p_camera.z - radius).max(0.25 * p_camera.z);
    let columns = span(u, reach * k.fx, k.width);
    let mut near: Vec<(f64, usize)> = Vec::new();
    for row in span(v, reach * k.fy, k.height) {
        for column in columns.clone() {
            let z = f64::from(sight.depth[(column, row)]);
            if z.is_finite() && z > 0.0 && !sight.ignored[(column, row)] {
                let p = k.back_project(column as f64, row as f64, z);
                near.push((((p - p_camera).norm() - radius).abs(), row * k.width + column));
            }
        }
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let support = near.iter().take(detection.pixels as usize).map(|(_, i)| *i);
    let label = most_frequent(support.clone().map(|i| view.truth.label.pixels()[i])).unwrap_or_default();
    let of_label = support.filter(|&i| view.truth.label.pixels()[i] == label);
    let instance = most_frequent(of_label.map(|i| view.truth.instance.pixels()[i]));
    (label, instance.filter(|_| label == Label::Fruit))
}

/// Range of pixels of a row or column within a distance of a position.
fn span(center: f64, half: f64, size: usize) -> std::ops::Range<usize> {
    // A float-to-integer cast saturates.
    let low = ((center - half).ceil().max(0.0) as usize).min(size);
    let high = ((center + half).floor() + 1.0).max(0.0) as usize;
    low..high.clamp(low, size)
}

/// The most frequent value; among equally frequent ones the smallest.
fn most_frequent<T: Ord + Copy>(values: impl Iterator<Item = T>) -> Option<T> {
    let mut counts: BTreeMap<T, u32> = BTreeMap::new();
    for value in values {
        *counts.entry(value).or_default() += 1;
    }
    let most = counts.values().copied().max()?;
    counts.into_iter().find(|(_, n)| *n == most).map(|(value, _)| value)
}

impl From<Label> for SitsOn {
    fn from(label: Label) -> Self {
        match label {
            Label::None => SitsOn::Nothing,
            Label::Fruit => SitsOn::Fruit,
            Label::Leaf => SitsOn::Leaf,
            Label::Wood => SitsOn::Wood,
            Label::Robot => SitsOn::Robot,
            Label::Ground => SitsOn::Ground,
            Label::Scenery => SitsOn::Scenery,
        }
    }
}

#[cfg(test)]
#[path = "score_tests.rs"]
mod tests;
