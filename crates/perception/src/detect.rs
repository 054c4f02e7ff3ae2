//! Detection of fruit in a depth image.

use crate::cloud::Cloud;
use crate::gates::{Gate, Limits};
use crate::noise::Noise;
use crate::search::{Hypothesis, Search};
use crate::segment::patches;
use crate::sphere::Sphere;
use crate::{DetectorConfig, PerceptionError};
use orchard_geometry::{DepthImage, Image, Intrinsics, Vec3};

/// A sphere that passed every gate.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Centre in the camera frame \[m\].
    pub p_camera: Vec3,
    /// Radius \[m\].
    pub radius: f64,
    /// Root mean square of the radial residual \[m\].
    pub rms: f64,
    /// Number of support pixels: those that lie on the sphere.
    pub pixels: u32,
    /// Centre (u, v) in the image \[px\].
    pub center_px: (f64, f64),
}

/// A sphere that was considered, with the first gate that refused it.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The detection as it would be reported.
    pub detection: Detection,
    /// Gate that refused the sphere; `None` if it passed all gates.
    pub refused_by: Option<Gate>,
}

/// Finds fruit in a depth image \[m\]. `mask` is true where a pixel must be ignored (robot, ground) and has the image's size.
///
/// A pixel that is not a positive finite number, or lies outside the working range, counts as no measurement.
///
/// # Errors
/// The image is empty, sizes disagree, or the intrinsics are not those of a pinhole camera.
pub fn detect(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
) -> Result<Vec<Detection>, PerceptionError> {
    let candidates = candidates(depth, intrinsics, mask, config)?;
    Ok(candidates.into_iter().filter(|c| c.refused_by.is_none()).map(|c| c.detection).collect())
}

/// Returns every sphere that [`detect`] considers, with the gate that refused it, for ablations and tests.
///
/// # Errors
/// Those of [`detect`].
pub fn candidates(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
) -> Result<Vec<Candidate>, PerceptionError> {
    let cloud = Cloud::new(depth, intrinsics, mask, config.segmentation.range.si())?;
    let limits = Limits::new(config);
    let mut marks = vec![false; cloud.len()];
    let mut out = Vec::new();
    let mut judge = |h: Hypothesis| {
        let refused_by = limits.refusal(&cloud, &h.sphere, &h.support, &mut marks);
        out.push((h, refused_by));
    };
    if config.fit.refine {
        Search::new(&cloud, config).run(judge);
    } else {
        let noise = Noise::new(config);
        for support in patches(&cloud, |z| noise.jump(z), limits.min_pixels) {
            let sphere = Sphere::fit(support.iter().map(|&i| cloud.point(i)));
            if let Some(sphere) = sphere.filter(|s| s.center.z > 0.0) {
                judge(Hypothesis { sphere, support });
            }
        }
    }
    Ok(without_duplicates(&cloud, out))
}

/// Keeps the sphere with the most pixels of accepted spheres whose centres lie within one radius of each other.
fn without_duplicates(cloud: &Cloud, mut hypotheses: Vec<(Hypothesis, Option<Gate>)>) -> Vec<Candidate> {
    // The sort is stable: equal sizes stay in image order.
    hypotheses.sort_by_key(|(h, _)| std::cmp::Reverse(h.support.len()));
    let mut out: Vec<Candidate> = Vec::new();
    for (h, refused_by) in hypotheses {
        let same = |c: &Candidate| {
            let d = &c.detection;
            c.refused_by.is_none() && (d.p_camera - h.sphere.center).norm() < d.radius.max(h.sphere.radius)
        };
        if refused_by.is_some() || !out.iter().any(same) {
            let detection = report(cloud, &h);
            out.push(Candidate { detection, refused_by });
        }
    }
    out
}

fn report(cloud: &Cloud, h: &Hypothesis) -> Detection {
    Detection {
        p_camera: h.sphere.center,
        radius: h.sphere.radius,
        rms: h.sphere.rms(h.support.iter().map(|&i| cloud.point(i))),
        pixels: h.support.len() as u32,
        // Callers keep z > 0.
        center_px: cloud.intrinsics.project(&h.sphere.center).unwrap_or((f64::NAN, f64::NAN)),
    }
}
