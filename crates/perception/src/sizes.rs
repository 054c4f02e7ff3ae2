//! Sizes of the fruit of an image: fruit of one tree are alike, so each tells something about the size of the others.
//!
//! A fruit's radius is normal about the mean of the image, and that mean is normal about the mean of the prior. Both variances together are
//! that of the prior, so an image with one fruit changes nothing but what the shape of the fruit leaves open.

use crate::DetectorConfig;
use crate::config::Prior;
use crate::geometric::{Candidate, Detection};
use orchard_geometry::Intrinsics;

/// Least share of the precision of the prior that the pixels of a fruit add: with less they tell no radius.
const LEAST_PRECISION: f64 = 1e-3;

/// Estimate of a fruit's radius by its pixels, without the prior.
struct Told {
    /// Radius without the prior \[m\].
    radius: f64,
    /// Variance of the radius of a fruit that is a sphere \[m^2\].
    variance: f64,
}

/// Takes the prior out of an estimate; `None` if pixels tell no radius.
fn told(d: &Detection, prior: &Prior) -> Option<Told> {
    let (mean, whole) = (prior.mean.si(), square(prior.deviation.si()));
    let precision = 1.0 / square(d.radius_deviation);
    let of_pixels = precision - 1.0 / whole;
    (of_pixels * whole > LEAST_PRECISION).then(|| Told {
        radius: (d.radius * precision - mean / whole) / of_pixels,
        variance: 1.0 / of_pixels,
    })
}

fn square(x: f64) -> f64 {
    x * x
}

/// Joins the radii of the spheres of an image within the limits of the radius, and moves their centres so that the pixels stay on them.
/// Each must have been fitted with the prior.
pub(crate) fn join(candidates: &mut [&mut Candidate], intrinsics: &Intrinsics, config: &DetectorConfig) {
    let prior = &config.fit.prior;
    let (smallest, largest) = config.gates.radius.si().unwrap_or((0.0, f64::INFINITY));
    let (mean, whole) = (prior.mean.si(), square(prior.deviation.si()));
    let within = square(prior.within.si()).min(whole);
    let between = whole - within;
    let all: Vec<(usize, Told)> = candidates
        .iter()
        .enumerate()
        .filter_map(|(number, candidate)| {
            let told = told(&candidate.detection, prior)?;
            Some((number, Told { variance: told.variance + square(prior.shape.si()), ..told }))
        })
        .collect();
    // With a variance of 0 between images, the mean is that of the prior.
    let (mut precision, mut sum) = (1.0, mean);
    for (number, one) in &all {
        let weight = candidates[*number].detection.score * between / (one.variance + within);
        precision += weight;
        sum += weight * one.radius;
    }
    let (of_image, variance_of_mean) = (sum / precision, between / precision);
    for (number, one) in &all {
        let of_pixels = within / (within + one.variance);
        let radius = (of_image + of_pixels * (one.radius - of_image)).clamp(smallest, largest);
        let variance = of_pixels * one.variance + square(1.0 - of_pixels) * variance_of_mean;
        let candidate = &mut candidates[*number];
        let d = &mut candidate.detection;
        d.p_camera += candidate.center_per_radius * (radius - d.radius);
        (d.radius, d.radius_deviation) = (radius, variance.sqrt());
        d.center_px = intrinsics.project(&d.p_camera).unwrap_or(d.center_px);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Evidence;
    use orchard_geometry::Vec3;

    const K: Intrinsics = Intrinsics { width: 640, height: 480, fx: 600.0, fy: 600.0, cx: 319.5, cy: 239.5 };

    fn candidate(radius: f64, radius_deviation: f64, score: f64) -> Candidate {
        let p_camera = Vec3::new(0.1, 0.0, 1.0);
        let detection = Detection {
            p_camera,
            radius,
            score,
            center_deviation: 2e-3,
            radius_deviation,
            visible: 0.8,
            rms: 1e-3,
            pixels: 300,
            center_px: K.project(&p_camera).unwrap(),
        };
        let evidence = Evidence {
            cover: 1.0,
            through: 0.0,
            visible: 0.8,
            rim: 1.0,
            beyond: 1.0,
            misfit: 0.5,
            flatness: 0.3,
            roundness: 0.6,
            outline: 1.0,
            outline_misfit: 0.05,
            outline_radius: None,
            radius,
        };
        Candidate { detection, refused_by: None, evidence, center_per_radius: Vec3::new(0.0, 0.0, 1.3) }
    }

    /// A camera's detector, with fruit of a shape.
    fn config(shape: &str) -> DetectorConfig {
        let text = format!(
            "base = \"scored\"\n[fit.prior]\nshape = {{ value = {shape}, range = [0.0, 1000.0], unit = \"mm\", source = \"detector\" }}"
        );
        DetectorConfig::from_toml("t.toml", &text).unwrap()
    }

    fn joined(given: &[(f64, f64, f64)], config: &DetectorConfig) -> Vec<Candidate> {
        let mut all: Vec<Candidate> = given.iter().map(|&(r, d, s)| candidate(r, d, s)).collect();
        join(&mut all.iter_mut().collect::<Vec<_>>(), &K, config);
        all
    }

    #[test]
    fn one_ball_keeps_its_size() {
        let found = &joined(&[(0.041, 2e-3, 1.0)], &config("0.0"))[0].detection;
        assert!((found.radius - 0.041).abs() < 1e-12 && (found.radius_deviation - 2e-3).abs() < 1e-12);
        assert!((found.p_camera - Vec3::new(0.1, 0.0, 1.0)).norm() < 1e-12);
        // The pixels of an apple tell less.
        let found = &joined(&[(0.041, 2e-3, 1.0)], &config("1.0"))[0].detection;
        assert!(found.radius < 0.041 && found.radius_deviation > 2e-3, "{found:?}");
        // A sphere whose size the prior alone tells, and one that nothing tells.
        for deviation in [6e-3, f64::INFINITY] {
            let found = &joined(&[(0.035, deviation, 1.0)], &config("1.0"))[0].detection;
            assert_eq!((found.radius, found.radius_deviation), (0.035, deviation));
        }
    }

    #[test]
    fn fruit_of_an_image_are_alike() {
        let many = [(0.039, 2e-3, 0.9); 30].into_iter().chain([(0.031, 4e-3, 0.9)]).collect::<Vec<_>>();
        let found = joined(&many, &config("1.0"));
        let (sure, unsure) = (&found[0].detection, &found[30].detection);
        assert!((sure.radius - 0.039).abs() < 5e-4, "{sure:?}");
        assert!(unsure.radius > 0.035 && unsure.radius < 0.038, "{unsure:?}");
        assert!(unsure.radius_deviation < 3e-3 && sure.radius_deviation < unsure.radius_deviation);
        // The pixels stay on the sphere.
        assert!((unsure.p_camera.z - 1.0 - 1.3 * (unsure.radius - 0.031)).abs() < 1e-12);
        assert_eq!(unsure.center_px, K.project(&unsure.p_camera).unwrap());
        // What is hardly a fruit says little about the others.
        let doubtful = joined(&[(0.035, 2e-3, 0.9), (0.045, 2e-3, 1e-6)], &config("1.0"));
        assert!((doubtful[0].detection.radius - 0.035).abs() < 1e-5);
        // Large ones stay within the limits of the radius.
        let config = config("1.0");
        let largest = config.gates.radius.limit.si().1;
        let large = joined(&[(largest - 1e-4, 2e-3, 0.9); 30], &config);
        assert!(large.iter().all(|c| c.detection.radius == largest), "{:?}", large[0].detection);
    }
}
