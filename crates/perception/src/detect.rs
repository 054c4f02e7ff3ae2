//! Depth image to detections.

use crate::cloud::Cloud;
use crate::gates::{Gate, Limits};
use crate::noise::Noise;
use crate::search::{Hypothesis, Search};
use crate::segment::patches;
use crate::sphere::Sphere;
use crate::{DetectorConfig, PerceptionError};
use orchard_geometry::{DepthImage, Image, Intrinsics, Vec3};

/// One sphere that passed every gate.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Centre in the camera frame [m].
    pub p_camera: Vec3,
    /// Radius [m].
    pub radius: f64,
    /// Root mean square of the radial residual [m].
    pub rms: f64,
    /// Pixels that support it.
    pub pixels: u32,
    /// Projected centre (u, v) [px].
    pub center_px: (f64, f64),
}

/// A sphere that was considered, and the first gate that refused it.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// What would have been reported.
    pub detection: Detection,
    /// `None`: it passed.
    pub refused_by: Option<Gate>,
}

/// Finds fruit in a depth image. `mask` is true where a pixel must be ignored (robot, ground).
///
/// Pixels that are not a positive finite number, or outside the working range, count as no measurement.
///
/// # Errors
/// Empty image, sizes that disagree, intrinsics that are not those of a pinhole.
pub fn detect(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
) -> Result<Vec<Detection>, PerceptionError> {
    let candidates = candidates(depth, intrinsics, mask, config)?;
    Ok(candidates.into_iter().filter(|c| c.refused_by.is_none()).map(|c| c.detection).collect())
}

/// Every sphere that [`detect`] considers, with the gate that refused it: for ablations and tests.
///
/// # Errors
/// As [`detect`].
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

/// Of accepted spheres whose centres lie within one radius, keeps the one with the most pixels.
fn without_duplicates(cloud: &Cloud, mut hypotheses: Vec<(Hypothesis, Option<Gate>)>) -> Vec<Candidate> {
    // Stable: equal sizes stay in image order.
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
