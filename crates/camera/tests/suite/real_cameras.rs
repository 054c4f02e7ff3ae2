//! Time of flight and registration follow the laws of `docs/computation/sensor.md`, and the cameras' detectors find fruit in their images.

use super::common;
use super::score::{Score, add_image, vantages};
use orchard_camera::{Geometry, ImageKey, Label, Scene, Sensor};
use orchard_geometry::{DepthImage, Pose, Shape, Vec3};
use orchard_perception::DetectorConfig;
use orchard_spec::camera::CameraSpec;

/// Adds a wall at depth `z` \[m\] whose left edge lies at `x` \[m\].
fn add_wall(scene: &mut Scene, z: f64, x: f64) {
    let half = Vec3::new(5.0, 5.0, 0.005);
    let centre = Pose::translation(x + half.x, 0.0, z + half.z);
    scene.push(Geometry::Shape(Shape::Box { half }), centre, Label::Scenery, 0);
}

fn capture(camera: &str, scene: &Scene) -> (Sensor, DepthImage, DepthImage) {
    let sensor = Sensor::new(&CameraSpec::named(camera).unwrap());
    let key = ImageKey { seed: 20_250_704, world: 0, frame: 0 };
    let capture = sensor.capture(scene, &Pose::identity(), key);
    (sensor, capture.measured, capture.truth.depth)
}

/// Depths of the middle row.
fn middle(depth: &DepthImage) -> Vec<f64> {
    (0..depth.width()).map(|u| f64::from(depth[(u, depth.height() / 2)])).collect()
}

#[test]
fn the_noise_of_time_of_flight_grows_as_light_fades() {
    for z in [0.6, 1.0, 1.6] {
        let mut scene = Scene::default();
        add_wall(&mut scene, z, -5.0);
        let (_, measured, _) = capture("azure-kinect-native", &scene);
        let (mut sum, mut squares, mut n) = (0.0, 0.0, 0.0_f64);
        for v in 100..476 {
            for u in 100..540 {
                let error = f64::from(measured[(u, v)]) - z;
                assert!(error > -z, "a hole in a wall at {z} m");
                (sum, squares, n) = (sum + error, squares + error * error, n + 1.0);
            }
        }
        let deviation = (squares / n - (sum / n) * (sum / n)).sqrt();
        // Figures of the config at its light, 0.6: 0.4 mm, and 0.4 + 0.6 (1.2 - 0.4) mm at 1 m.
        let expected = orchard_geometry::math::hypot(0.0004, 0.00088 * z * z);
        assert!((deviation / expected - 1.0).abs() < 0.03, "{z} m: {deviation} instead of {expected}");
        assert!((sum / n).abs() < 1e-4, "{z} m: mean error {}", sum / n);
    }
}

#[test]
fn a_small_step_becomes_a_ramp_and_a_large_one_a_gap() {
    for (behind, has_gap) in [(1.08, false), (1.4, true)] {
        let mut scene = Scene::default();
        add_wall(&mut scene, behind, -5.0);
        add_wall(&mut scene, 1.0, 0.0);
        let (_, measured, truth) = capture("azure-kinect-native", &scene);
        let (row, true_row) = (middle(&measured), middle(&truth));
        let edge = true_row.iter().position(|&z| z < 1.04).unwrap();
        let near = edge - 8..edge + 8;
        assert_eq!(row[near.clone()].contains(&0.0), has_gap, "step to {behind} m");
        if !has_gap {
            let largest = row[near].windows(2).map(|z| (z[1] - z[0]).abs()).fold(0.0, f64::max);
            assert!(largest < 0.5 * (behind - 1.0), "a jump of {largest} m in a ramp of 0.08 m");
        }
    }
}

#[test]
fn registered_depth_lies_where_the_colour_camera_sees_it() {
    for name in ["azure-kinect", "d435i-aligned"] {
        let mut scene = Scene::default();
        add_wall(&mut scene, 1.4, -5.0);
        // Its right edge lies 5 cm right of the axis.
        add_wall(&mut scene, 0.8, 0.05 - 10.0);
        let (_, measured, truth) = capture(name, &scene);
        let (row, true_row) = (middle(&measured), middle(&truth));
        let last = |row: &[f64]| row.iter().rposition(|&z| z > 0.0 && z < 0.9).unwrap();
        let (edge, true_edge) = (last(&row), last(&true_row));
        // A pixel of the imager is about two of the camera's, and an edge is displaced by up to three of them.
        assert!(edge.abs_diff(true_edge) <= 6, "{name}: the edge lies at {edge} instead of {true_edge}");
        // The imager, left of the camera, sees nothing of the far wall right of the edge.
        assert!(row[edge + 1..edge + 5].iter().all(|&z| z == 0.0), "{name}: no shadow");
        assert!(row[edge + 40..edge + 80].iter().any(|&z| (z - 1.4).abs() < 0.1), "{name}: no far wall");
    }
}

#[test]
fn detectors_of_noisy_cameras_find_fruit_with_a_score() {
    for name in ["azure-kinect", "d435i-aligned", "zed-mini"] {
        let sensor = Sensor::new(&CameraSpec::named(name).unwrap());
        let scene = common::orchard(1, 350, 40);
        let config = DetectorConfig::named(name).unwrap();
        let mut score = Score::default();
        for (frame, x) in (0..).zip(vantages(8)) {
            let measured = sensor.capture(&scene, &x, ImageKey { seed: 1, world: 0, frame }).measured;
            let k = sensor.intrinsics();
            let (_, found) = add_image(&mut score, &scene, k, &x, &config, |image| image.depth = measured);
            for d in &found {
                assert!(d.score >= config.score.least.si() && d.score <= 1.0, "{name}: score {}", d.score);
                assert!(
                    d.radius_deviation > 0.0 && d.radius_deviation < 0.006,
                    "{name}: {}",
                    d.radius_deviation
                );
                assert!((0.0..=1.0).contains(&d.visible));
            }
            assert!(found.windows(2).all(|pair| pair[0].score >= pair[1].score), "{name}: not sorted");
        }
        assert!(score.visible > 10, "{name}: {score:?}");
        println!("{name}: precision {:.2}, recall {:.2}", score.precision(), score.recall());
        assert!(score.precision() >= 0.8 && score.recall() >= 0.4, "{name}: {score:?}");
    }
}
