//! Search of the geometric detector: spheres that fit the points of a depth image, with their evidence.

use crate::cloud::Cloud;
use crate::evidence::{Evidence, Examiner};
use crate::gates::{Gate, Limits};
use crate::noise::Noise;
use crate::posterior::Posterior;
use crate::search::{Hypothesis, Search};
use crate::segment::patches;
use crate::sphere::Sphere;
use crate::votes;
use crate::{DetectorConfig, PerceptionError};
use orchard_geometry::{DepthImage, Image, Intrinsics, Vec3};

/// A sphere that passed every gate.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Centre in the camera frame \[m\].
    pub p_camera: Vec3,
    /// Radius \[m\].
    pub radius: f64,
    /// Probability that it is a fruit, by the evidence.
    pub score: f64,
    /// Standard deviation of the centre's distance from `p_camera` \[m\]; infinite if too few pixels determine it.
    pub center_deviation: f64,
    /// Standard deviation of the radius \[m\]; infinite if too few pixels determine it.
    pub radius_deviation: f64,
    /// Share of its disc that is seen.
    pub visible: f64,
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
    /// Evidence for and against it.
    pub evidence: Evidence,
    /// Movement of the centre for each metre by which the radius is changed, so that the pixels stay on the sphere.
    pub(crate) center_per_radius: Vec3,
}

/// Returns the spheres that `wanted` takes by the gate that refused them; the score refuses afterwards.
pub(crate) fn search(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    mask: Option<&Image<bool>>,
    config: &DetectorConfig,
    wanted: impl Fn(Option<Gate>) -> bool,
) -> Result<Vec<Candidate>, PerceptionError> {
    let step = config.fit.sampling.get() as usize;
    let cloud = Cloud::new(depth, intrinsics, mask, config.segmentation.range.si(), step)?;
    let limits = Limits::new(config);
    let report = Report::new(&cloud, intrinsics, config);
    let mut marks = vec![false; cloud.len()];
    let (mut out, mut scored) = (Vec::new(), Vec::new());
    let mut judge = |h: Hypothesis| {
        let refused_by = limits.refusal(&cloud, &h.sphere, &h.support, &mut marks);
        if wanted(refused_by) {
            if config.score.on {
                scored.push(report.judged(&h, refused_by));
            } else {
                out.push((h, refused_by));
            }
        }
    };
    if config.fit.use_prior {
        votes::run(&cloud, config, judge);
    } else if config.fit.refine {
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
    if !config.score.on {
        // The sort is stable: equal sizes stay in image order.
        out.sort_by_key(|(h, _)| std::cmp::Reverse(h.support.len()));
        let kept = without_duplicates(out, |(h, refused_by)| refused_by.is_none().then_some(h.sphere));
        return Ok(kept.iter().map(|(h, refused_by)| report.of(&report.judged(h, *refused_by))).collect());
    }
    scored.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept = without_duplicates(scored, |judged| judged.refused_by.is_none().then_some(judged.sphere));
    let least = config.score.least.si();
    for judged in kept.iter_mut().filter(|j| j.refused_by.is_none() && j.score < least) {
        judged.refused_by = Some(Gate::Score);
    }
    Ok(kept.iter().filter(|j| wanted(j.refused_by)).map(|judged| report.of(judged)).collect())
}

/// Keeps the first of accepted spheres whose centres lie within one radius of each other, and all refused ones. `accepted` returns the
/// sphere of an accepted one.
pub(crate) fn without_duplicates<T>(all: Vec<T>, accepted: impl Fn(&T) -> Option<Sphere>) -> Vec<T> {
    let mut out: Vec<T> = Vec::new();
    let mut taken: Vec<Sphere> = Vec::new();
    for one in all {
        if let Some(sphere) = accepted(&one) {
            let same = |t: &Sphere| (t.center - sphere.center).norm() < t.radius.max(sphere.radius);
            if taken.iter().any(same) {
                continue;
            }
            taken.push(sphere);
        }
        out.push(one);
    }
    out
}

/// A sphere with its evidence.
pub(crate) struct Judged {
    sphere: Sphere,
    /// Number of pixels on it, of the cloud.
    pixels: usize,
    refused_by: Option<Gate>,
    evidence: Evidence,
    /// Root mean square of the radial residual \[m\].
    rms: f64,
    score: f64,
}

/// Judges spheres and makes reports of them.
pub(crate) struct Report<'a> {
    cloud: &'a Cloud,
    /// Of the image, not of the cloud.
    intrinsics: &'a Intrinsics,
    config: &'a DetectorConfig,
    examiner: Examiner,
    posterior: Posterior,
}

impl<'a> Report<'a> {
    pub(crate) fn new(cloud: &'a Cloud, intrinsics: &'a Intrinsics, config: &'a DetectorConfig) -> Self {
        let (examiner, posterior) = (Examiner::new(config), Posterior::new(config));
        Self { cloud, intrinsics, config, examiner, posterior }
    }

    pub(crate) fn judged(&self, hypothesis: &Hypothesis, refused_by: Option<Gate>) -> Judged {
        let (evidence, rms) = self.examiner.examine(self.cloud, hypothesis);
        let score = evidence.score(&self.config.score.weights, &self.config.fit.prior);
        let Hypothesis { sphere, support } = hypothesis;
        Judged { sphere: *sphere, pixels: support.len(), refused_by, evidence, rms, score }
    }

    pub(crate) fn of(&self, judged: &Judged) -> Candidate {
        let Judged { sphere, pixels, refused_by, evidence, rms, score } = judged;
        let deviations = self.posterior.deviations(self.cloud, sphere);
        let detection = Detection {
            p_camera: sphere.center,
            radius: sphere.radius,
            score: *score,
            center_deviation: deviations.center,
            radius_deviation: deviations.radius,
            visible: evidence.visible,
            rms: *rms,
            pixels: (pixels * self.cloud.step * self.cloud.step) as u32,
            // Callers keep z > 0.
            center_px: self.intrinsics.project(&sphere.center).unwrap_or((f64::NAN, f64::NAN)),
        };
        let center_per_radius = deviations.center_per_radius;
        Candidate { detection, refused_by: *refused_by, evidence: *evidence, center_per_radius }
    }
}
