//! Missing depth: half occlusion, thin objects before the sky, windows without a match in the sun.

use crate::{Camera, NO_DROPOUT};
use orchard_camera::Scene;

/// Figures without noise of edges.
const SHARP: (&str, f64, &str) = ("edge_shift", 0.0, "px");
/// Steps stay steps.
const NO_RAMP: (&str, f64, &str) = ("edge_ramp", 0.0, "px");

#[test]
fn surfaces_hidden_from_the_other_imager_are_missing() {
    let camera = Camera::new(&[NO_DROPOUT, SHARP]);
    let (edge, width) = (400, camera.sensor.intrinsics().width);
    for (z_near, z_far) in [(0.6, 2.0), (1.0, 1.5), (0.5, 2.8)] {
        let mut scene = Scene::default();
        camera.wall(&mut scene, z_near, edge..=width - 1);
        camera.wall(&mut scene, z_far, 0..=width - 1);
        let measured = camera.take(&scene, 0).measured;
        let (d_near, d_far) = (camera.disparity(z_near), camera.disparity(z_far));
        let column = |u: usize, d: f64| (u as f64 - d + 0.5).floor();
        for v in 0..measured.height() {
            let row: Vec<f32> = (0..width).map(|u| measured[(u, v)]).collect();
            for (u, &z) in row.iter().enumerate().skip(d_far.ceil() as usize) {
                let hidden = u < edge && column(u, d_far) >= column(edge, d_near);
                assert_eq!(z == 0.0, hidden, "{z_near} {z_far}: pixel ({u}, {v})");
            }
            // The shadow is as wide as the disparities differ, to a pixel's rounding.
            let shadow = (d_far.ceil() as usize..edge).filter(|&u| row[u] == 0.0).count() as f64;
            assert!((shadow - (d_near - d_far)).abs() <= 1.0);
        }
    }
}

#[test]
fn thin_things_need_something_behind_them() {
    let camera = Camera::new(&[NO_DROPOUT, SHARP, NO_RAMP]);
    let (w, least) = (camera.window(), camera.spec.least_support.si());
    let (first, z) = (300, 1.0);
    for thickness in 1..=w {
        let strip = first..=first + thickness - 1;
        let (mut alone, mut before) = (Scene::default(), Scene::default());
        for scene in [&mut alone, &mut before] {
            camera.wall(scene, z, strip.clone());
        }
        // Out of range, but there.
        camera.wall(&mut before, 4.0, 0..=camera.sensor.intrinsics().width - 1);
        let (alone, before) = (camera.take(&alone, 0).measured, camera.take(&before, 0).measured);
        for v in 0..alone.height() {
            for u in strip.clone() {
                let reach = w / 2;
                let in_window = (u - reach..=u + reach).filter(|u| strip.contains(u)).count();
                let kept = in_window as f64 / w as f64 >= least;
                assert_eq!(alone[(u, v)] > 0.0, kept, "{thickness} px, pixel ({u}, {v})");
            }
            // Behind it the far wall is half hidden: its visible part in the window suffices.
            let hidden = (camera.disparity(z) - camera.disparity(4.0)).ceil() as usize;
            let seen = w - hidden.min(thickness);
            for u in strip.clone().filter(|_| seen as f64 / w as f64 >= least) {
                assert!(before[(u, v)] > 0.0, "{thickness} px before a wall, pixel ({u}, {v})");
            }
        }
        assert!(alone.pixels().iter().enumerate().all(|(i, &z)| z == 0.0 || strip.contains(&(i % 848))));
    }
    // A wire of a pixel and a half vanishes before the sky and is there before a wall.
    assert!(1.5 / (w as f64) < least);
}

#[test]
fn the_share_of_dropped_pixels_follows_the_sun() {
    const IMAGES: u32 = 6;
    let z = 1.0;
    let mut last = (-1.0, 0.0);
    for sunlight in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let camera = Camera::new(&[("sunlight", sunlight, "1")]);
        let expected = camera.spec.dropout_share();
        let scene = camera.whole_wall(z);
        let (mut missing, mut n) = (0.0, 0.0);
        for frame in 0..IMAGES {
            let measured = camera.take(&scene, frame).measured;
            for v in 0..measured.height() {
                for u in camera.disparity(z).ceil() as usize..measured.width() {
                    missing += f64::from(u8::from(measured[(u, v)] == 0.0));
                    n += 1.0;
                }
            }
        }
        let share = missing / n;
        // Refused pixels come in windows: fewer than (2 w)^2 neighbours count as one.
        let alike = 4.0 * (camera.window() * camera.window()) as f64;
        let allowed = 5.0 * (expected * (1.0 - expected) * alike / n).sqrt();
        assert!((share - expected).abs() <= allowed, "{sunlight}: {share} {expected}");
        let now = (share, camera.spec.disparity_sd());
        assert!(now.0 > last.0 && now.1 > last.1);
        last = now;
    }
    let ends = [0.0, 1.0].map(|sunlight| Camera::new(&[("sunlight", sunlight, "1")]).spec);
    assert_eq!(ends.each_ref().map(|spec| spec.dropout_share()), [0.0, 0.05]);
    assert_eq!(ends.each_ref().map(|spec| spec.disparity_sd()), [0.05, 0.1]);
}
