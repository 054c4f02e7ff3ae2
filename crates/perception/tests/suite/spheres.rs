//! Balls are found at their positions: alone, touching other objects, and cut by twigs.

use super::common;

use common::*;
use orchard_geometry::Vec3;
use orchard_perception::{Detection, DetectorConfig, detect};
use proptest::prelude::*;

fn assert_ball(d: &Detection, center: &Vec3, radius: f64, tolerance: f64) {
    let error = (d.p_camera - center).norm().max((d.radius - radius).abs());
    assert!(error <= tolerance, "{error:e}: {d:?}");
}

/// With exact points the linear fit is exact except for the rounding of f32 depth, 3e-8 m at 0.5 m, times the ratio of the ball's radius to
/// the relief of its visible cap (a few).
#[test]
fn an_exact_ball_is_recovered_to_a_micrometre() {
    for config in [one_fit_a_patch(), DetectorConfig::paper()] {
        for (p, radius) in [([0.0, 0.0, 0.5], 0.03), ([0.12, -0.09, 0.6], 0.035), ([-0.2, 0.2, 0.8], 0.05)] {
            let center = Vec3::from(p);
            let detections = found(&[&ball(center, radius)], &config);
            assert_eq!(detections.len(), 1);
            assert_ball(&detections[0], &center, radius, 1e-6);
            let (u, v) = detections[0].center_px;
            let (eu, ev) = camera().project(&center).unwrap();
            assert!((u - eu).abs() < 1e-3 && (v - ev).abs() < 1e-3);
        }
    }
}

#[test]
fn a_ball_that_touches_a_leaf_is_found() {
    let center = Vec3::new(0.0, 0.0, 0.55);
    let ball = ball(center, 0.032);
    // A blade that leans against the ball's side, continuous in depth with it.
    let leaf = part(plane(Vec3::new(0.0, 0.03, 0.535), Vec3::new(0.1, 0.2, 1.0)), |p| {
        p.y > 0.02 && p.y < 0.07 && p.x.abs() < 0.03
    });
    assert!(found(&[&ball, &leaf], &one_fit_a_patch()).is_empty(), "the patch must join the two");
    let detections = found(&[&ball, &leaf], &DetectorConfig::paper());
    assert_eq!(detections.len(), 1);
    // Blade pixels that lie within the 1 mm band of the sphere pull the fit by a part of that band.
    assert_ball(&detections[0], &center, 0.032, 1e-3);
}

#[test]
fn two_touching_balls_are_two() {
    let (a, b) = (Vec3::new(-0.03, 0.0, 0.5), Vec3::new(0.031, 0.01, 0.51));
    let (ball_a, ball_b) = (ball(a, 0.03), ball(b, 0.032));
    let detections = found(&[&ball_a, &ball_b], &DetectorConfig::paper());
    assert_eq!(detections.len(), 2, "{detections:?}");
    for (center, radius) in [(a, 0.03), (b, 0.032)] {
        let nearest = detections
            .iter()
            .min_by(|x, y| (x.p_camera - center).norm().total_cmp(&(y.p_camera - center).norm()));
        assert_ball(nearest.unwrap(), &center, radius, 1e-3);
    }
}

#[test]
fn a_ball_cut_by_a_twig_is_one() {
    let center = Vec3::new(0.02, 0.0, 0.5);
    let ball = ball(center, 0.033);
    let twig = cylinder_along_x(Vec3::new(0.0, 0.0, 0.44), 0.004);
    let detections = found(&[&ball, &twig], &DetectorConfig::paper());
    assert_eq!(detections.len(), 1, "{detections:?}");
    assert_ball(&detections[0], &center, 0.033, 1e-4);
}

#[test]
fn masked_and_out_of_range_balls_are_ignored() {
    let k = camera();
    let config = DetectorConfig::paper();
    let near = ball(Vec3::new(0.0, 0.0, 0.5), 0.03);
    let depth = image(&k, &[&near]);
    let everything = orchard_geometry::Image::filled(k.width, k.height, true);
    assert!(detect(&depth, &k, Some(&everything), &config).unwrap().is_empty());
    for z in [0.25, 1.45] {
        let out = ball(Vec3::new(0.0, 0.0, z), 0.05);
        assert!(found(&[&out], &config).is_empty(), "{z}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// A lone ball of any apple size anywhere well inside the image and range is found exactly once.
    #[test]
    fn any_lone_ball_is_found(
        x in -0.4..0.4, y in -0.3..0.3, z in 0.36..1.0, radius in 0.025..0.05,
    ) {
        let center = Vec3::new(x * z, y * z, z);
        let detections = found(&[&ball(center, radius)], &DetectorConfig::paper());
        prop_assert_eq!(detections.len(), 1);
        assert_ball(&detections[0], &center, radius, 1e-5);
    }
}
