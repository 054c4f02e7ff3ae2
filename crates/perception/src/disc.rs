//! Spheres from discs: an image shows where a fruit is and how large it looks, its pixels how far it is.

use crate::cloud::Cloud;
use crate::gates::{Gate, Limits};
use crate::geometric::{Candidate, Report};
use crate::noise::Noise;
use crate::region::{Part, Region};
use crate::search::Hypothesis;
use crate::sphere::Sphere;
use crate::{DetectorConfig, PerceptionError};
use orchard_geometry::{DepthImage, Image, Intrinsics};

/// Pixels that tell the depth lie within this share of the disc's radius.
const INNER: f64 = 0.7;
/// Standard deviation of a disc's radius, as a share of it.
const DEVIATION: f64 = 0.1;
/// Rounds in which depth and radius follow from each other.
const ROUNDS: usize = 3;

/// Disc of a fruit in an image \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Disc {
    /// Column and row of its centre.
    pub(crate) center: (f64, f64),
    pub(crate) radius: f64,
}

/// Returns the sphere behind a disc. Its centre is on the ray of the disc's, its radius that of the disc and of the prior together. Its depth is the mean of two: of the median of
/// the depths of the centre that the region's pixels of the disc tell, with standard deviation `deviation` \[m\], and of the fit's, with that of the noise. A fit that is farther from the
/// first than a radius is of something else and does not count.
/// `None` if too little of it is measured.
pub(crate) fn sphere(
    depth: &DepthImage,
    k: &Intrinsics,
    mask: Option<&Image<bool>>,
    (disc, region): (&Disc, &Region),
    (fit, deviation): (Option<&Candidate>, f64),
    config: &DetectorConfig,
) -> Result<Option<Candidate>, PerceptionError> {
    let Some(part) = Part::of(depth, k, mask, region) else { return Ok(None) };
    let step = config.fit.sampling.get() as usize;
    let range = config.segmentation.range.si();
    let cloud = Cloud::new(&part.depth, &part.intrinsics, Some(&part.left_out), range, step)?;
    let ray = k.ray(disc.center.0, disc.center.1);
    let focal = (k.fx * k.fy).sqrt();
    let (prior, noise) = (&config.fit.prior, Noise::new(config));
    let of_prior = precision(prior.deviation.si());
    let (mut radius, mut z) = (prior.mean.si(), 0.0);
    for _ in 0..ROUNDS {
        // Depths of the centre, by each pixel.
        let mut depths: Vec<f64> = Vec::new();
        for i in 0..cloud.len() {
            let measured = cloud.usable_z(i);
            let (u, v) = cloud.uv(i);
            let off = (cloud.ray(u, v) - ray).norm() * focal / disc.radius;
            if measured > 0.0 && off <= INNER {
                depths.push(measured + radius * (1.0 - off * off).sqrt());
            }
        }
        if depths.is_empty() {
            return Ok(None);
        }
        let middle = depths.len() / 2;
        z = *depths.select_nth_unstable_by(middle, f64::total_cmp).1;
        let of_it = |fit: &&Candidate| (fit.detection.p_camera.z - z).abs() <= radius;
        if let Some(fit) = fit.filter(of_it) {
            let (own, of_fit) = (precision(deviation), precision(noise.deviation(z)));
            z = (z * own + fit.detection.p_camera.z * of_fit) / (own + of_fit);
        }
        let seen = disc.radius * z / focal;
        let of_disc = precision(DEVIATION * seen);
        radius = (prior.mean.si() * of_prior + seen * of_disc) / (of_prior + of_disc);
    }
    let sphere = Sphere { center: ray * z, radius };
    let band = noise.band(z);
    let mut support = Vec::new();
    cloud.usable_in_ball(&sphere.center, radius + band, |i, p| {
        if sphere.residual(&p).abs() <= band {
            support.push(i);
        }
    });
    let mut marks = vec![false; cloud.len()];
    let refused_by = Limits::new(config).refusal(&cloud, &sphere, &support, &mut marks);
    if z <= radius || matches!(refused_by, Some(Gate::MinPixels | Gate::Radius)) {
        return Ok(None);
    }
    let report = Report::new(&cloud, &part.intrinsics, config);
    let found = report.of(&report.judged(&Hypothesis { sphere, support }, refused_by));
    Ok(Some(part.in_image(found)))
}

/// Weight of a value in a mean, by its standard deviation.
fn precision(deviation: f64) -> f64 {
    1.0 / (deviation * deviation)
}
