//! Depth images of analytic surfaces.
#![allow(dead_code)] // each test file uses its part

use orchard_geometry::{DepthImage, Intrinsics, Vec3};
use orchard_perception::{Candidate, Detection, DetectorConfig, candidates, detect};

/// The paper's camera.
pub fn camera() -> Intrinsics {
    Intrinsics::from_vertical_fov(192, 144, 75_f64.to_radians())
}

/// A surface: the depth t at which the ray t (x, y, 1) meets it, if it does.
pub type Surface<'a> = &'a dyn Fn(&Vec3) -> Option<f64>;

/// The image of the nearest of some surfaces.
pub fn image(k: &Intrinsics, surfaces: &[Surface]) -> DepthImage {
    let pixel = |i: usize| {
        let ray = k.ray((i % k.width) as f64, (i / k.width) as f64);
        let hits = surfaces.iter().filter_map(|s| s(&ray)).filter(|t| *t > 0.0);
        hits.min_by(f64::total_cmp).unwrap_or(0.0) as f32
    };
    DepthImage::from_pixels(k.width, k.height, (0..k.width * k.height).map(pixel).collect()).unwrap()
}

/// Near side of a ball.
pub fn ball(center: Vec3, radius: f64) -> impl Fn(&Vec3) -> Option<f64> {
    move |d| ball_sides(d, &center, radius).map(|(near, _)| near)
}

/// Far side of a ball: the inside of a bowl.
pub fn bowl(center: Vec3, radius: f64) -> impl Fn(&Vec3) -> Option<f64> {
    move |d| ball_sides(d, &center, radius).map(|(_, far)| far)
}

fn ball_sides(d: &Vec3, center: &Vec3, radius: f64) -> Option<(f64, f64)> {
    let (a, b) = (d.norm_squared(), d.dot(center));
    let disc = b * b - a * (center.norm_squared() - radius * radius);
    (disc >= 0.0).then(|| ((b - disc.sqrt()) / a, (b + disc.sqrt()) / a))
}

/// A plane through `p` with a normal.
pub fn plane(p: Vec3, normal: Vec3) -> impl Fn(&Vec3) -> Option<f64> {
    move |d| Some(normal.dot(&p) / normal.dot(d)).filter(|t| t.is_finite() && *t > 0.0)
}

/// The part of a surface whose points satisfy a condition.
pub fn part(
    surface: impl Fn(&Vec3) -> Option<f64>,
    keep: impl Fn(&Vec3) -> bool,
) -> impl Fn(&Vec3) -> Option<f64> {
    move |d| surface(d).filter(|t| keep(&(d * *t)))
}

/// An infinite cylinder of a radius about the line through `p` along x.
pub fn cylinder_along_x(p: Vec3, radius: f64) -> impl Fn(&Vec3) -> Option<f64> {
    let flat = move |v: &Vec3| Vec3::new(0.0, v.y, v.z);
    move |d| ball_sides(&flat(d), &flat(&p), radius).map(|(near, _)| near)
}

/// Detections of the surfaces by the paper's camera.
pub fn found(surfaces: &[Surface], config: &DetectorConfig) -> Vec<Detection> {
    let k = camera();
    detect(&image(&k, surfaces), &k, None, config).unwrap()
}

/// All candidates of the surfaces.
pub fn considered(surfaces: &[Surface], config: &DetectorConfig) -> Vec<Candidate> {
    let k = camera();
    candidates(&image(&k, surfaces), &k, None, config).unwrap()
}

/// The paper's pipeline, one fit per patch, with our rule for hidden pixels.
pub fn one_fit_a_patch() -> DetectorConfig {
    let mut config = DetectorConfig::paper();
    config.fit.refine = false;
    config
}
