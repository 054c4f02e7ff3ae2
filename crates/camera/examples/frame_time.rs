//! Prints the times of one nominal depth image and of the detector on it, on this machine.

#[path = "../tests/suite/common/mod.rs"]
mod common;

use orchard_camera::{Frame, picture::look_at, render};
use orchard_geometry::{Intrinsics, Vec3};
use orchard_perception::{DetectorConfig, detect};

fn main() {
    let scene = common::orchard(1, 350, 40);
    let k = Intrinsics::from_vertical_fov(192, 144, 75_f64.to_radians());
    let mut frame = Frame::new(192, 144);
    for eye in [[-0.75, 0.0, 1.1], [-0.4, 0.1, 1.0], [-1.5, 0.3, 1.3]] {
        let x = look_at(&Vec3::from(eye), &Vec3::new(0.0, 0.0, 1.0));
        let mut best = f64::INFINITY;
        for _ in 0..50 {
            let start = std::time::Instant::now();
            render(&scene, &k, &x, 0.3, 3.0, &mut frame);
            best = best.min(start.elapsed().as_secs_f64());
        }
        let config = DetectorConfig::paper();
        let mut best_detect = f64::INFINITY;
        let mut found = 0;
        for _ in 0..10 {
            let start = std::time::Instant::now();
            found = detect(&frame.depth, &k, None, &config).map_or(0, |d| d.len());
            best_detect = best_detect.min(start.elapsed().as_secs_f64());
        }
        let mut counts = std::collections::BTreeMap::new();
        for c in orchard_perception::candidates(&frame.depth, &k, None, &config).unwrap_or_default() {
            *counts.entry(c.refused_by).or_insert(0) += 1;
        }
        println!("  candidates by the gate that refused them: {counts:?}");
        println!("  detector {:.2} ms, {found} found", 1e3 * best_detect);
        let valid = frame.depth.pixels().iter().filter(|&&z| z > 0.0).count();
        println!("{eye:?}: {:.2} ms, {} items, {valid} valid pixels", 1e3 * best, scene.items.len());
    }
}
