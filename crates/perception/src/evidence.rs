//! Evidence for and against a sphere: how well the pixels of its disc and those around it agree with a fruit.

use crate::cloud::{Cloud, Pixel};
use crate::config::DetectorConfig;
use crate::cylinder;
use crate::noise::Noise;
use crate::outline;
use crate::search::Hypothesis;
use nalgebra::SymmetricEigen;
use orchard_geometry::{Mat3, Vec3};

/// Outer radius of the ring around a silhouette in which surroundings are judged, as a multiple of the sphere's radius.
const RING: f64 = 1.4;
/// A sector shows its rim if pixels of the sphere lie at least this far from the centre of the disc, as a share of its radius.
const NEAR_RIM: f64 = 0.7;
/// A pixel of the ring lies beyond the sphere if it is this far behind the centre, as a share of the radius.
const BEYOND: f64 = 0.3;
/// Widest ramp at a silhouette, as a share of the radius, that is left out.
const WIDEST_RAMP: f64 = 0.5;
/// Weight of a pixel without a measurement in the middle of a disc, where a surface would have been seen.
const HOLE: f64 = 0.5;
/// Largest ratio of two residuals.
const LARGEST_RATIO: f64 = 10.0;

/// Evidence for and against a sphere. All but the radius are shares or ratios, so that they mean the same for every camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Share of the disc that lies on the sphere, of the pixels that nothing hides.
    pub cover: f64,
    /// Share of the disc where depth lies behind the sphere, of the pixels that nothing hides.
    pub through: f64,
    /// Share of the disc that lies on the sphere, of all its pixels.
    pub visible: f64,
    /// Share of the silhouette's octants in which the sphere can be followed to its rim.
    pub rim: f64,
    /// Share of the ring around the silhouette that lies behind the sphere or has no measurement.
    pub beyond: f64,
    /// RMS of the radial residual over the standard deviation of the depth noise.
    pub misfit: f64,
    /// RMS of the residual over that of the best plane.
    pub flatness: f64,
    /// RMS of the residual over that of the best cylinder.
    pub roundness: f64,
    /// Share of the silhouette's directions in which the surface ends on a circle.
    pub outline: f64,
    /// RMS distance of those ends from the circle, as a share of its radius; 1 without a circle.
    pub outline_misfit: f64,
    /// Radius by the outline \[m\]; `None` without a circle.
    pub outline_radius: Option<f64>,
    /// Radius of the sphere \[m\].
    pub radius: f64,
}

/// Measures evidence with the noise of one camera.
#[derive(Debug, Clone)]
pub(crate) struct Examiner {
    noise: Noise,
    hides: f64,
    ramp: f64,
}

impl Examiner {
    pub(crate) fn new(config: &DetectorConfig) -> Self {
        Self { noise: Noise::new(config), hides: config.gates.hidden.limit.si(), ramp: config.fit.ramp.si() }
    }

    /// Measures the evidence for a sphere.
    pub(crate) fn examine(&self, cloud: &Cloud, hypothesis: &Hypothesis) -> Evidence {
        let Hypothesis { sphere, support } = hypothesis;
        let hides = self.hides.max(self.noise.band(sphere.center.z));
        let outline = outline::trace(cloud, sphere, hides);
        let shares = self.shares(cloud, hypothesis, hides);
        let points: Vec<Vec3> = support.iter().map(|&i| cloud.point(i)).collect();
        let rms = sphere.rms(points.iter().copied());
        let ratio = |a: f64, b: f64| if b > 0.0 { (a / b).min(LARGEST_RATIO) } else { LARGEST_RATIO };
        let metres = |px: f64| px * sphere.center.z / cloud.focal;
        Evidence {
            misfit: ratio(rms, self.noise.deviation(sphere.center.z)),
            flatness: ratio(rms, plane_rms(&points)),
            roundness: ratio(rms, cylinder::best_rms(&points)),
            outline: outline.ended,
            outline_misfit: outline.circle.map_or(1.0, |circle| circle.rms / circle.radius),
            outline_radius: outline.circle.map(|circle| metres(circle.radius)),
            radius: sphere.radius,
            ..shares
        }
    }

    /// Measures the shares of disc and ring; the other fields are zero. The ramp that the camera makes of an edge counts for neither.
    fn shares(&self, cloud: &Cloud, hypothesis: &Hypothesis, hides: f64) -> Evidence {
        let (c, radius) = (&hypothesis.sphere.center, hypothesis.sphere.radius);
        let band = self.noise.band(c.z);
        let ramp = (self.ramp * c.z / (radius * cloud.focal)).min(WIDEST_RAMP);
        let (center_u, center_v) = cloud.intrinsics.project(c).unwrap_or((0.0, 0.0));
        let square = |x: f64| x * x;
        let (mut on, mut hidden, mut through, mut before, mut holes) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let (mut ring, mut beyond) = (0.0_f64, 0.0);
        let mut rim = [false; 8];
        cloud.rays_of_ball(c, RING * radius, |i, ray| {
            let along = ray.dot(c) / ray.norm_squared();
            // Square of the distance between ray and centre, in radii.
            let off_axis = (c - ray * along).norm_squared() / square(radius);
            let z = cloud.z(i);
            if off_axis < square(1.0 - ramp) {
                let cosine = (1.0 - off_axis).sqrt();
                let z_sphere = along - radius * cosine / ray.norm();
                let residual = (z - z_sphere) * cosine;
                if z <= 0.0 {
                    holes += 1.0;
                } else if cloud.pixel(i) == Pixel::Masked || z < z_sphere - hides {
                    hidden += 1.0;
                } else if residual.abs() <= band {
                    on += 1.0;
                    if off_axis > square(NEAR_RIM) {
                        let (u, v) = cloud.uv(i);
                        rim[octant(u as f64 - center_u, v as f64 - center_v)] = true;
                    }
                } else if residual > 0.0 {
                    through += 1.0;
                } else {
                    before += 1.0;
                }
            } else if off_axis > square(1.0 + ramp) && !(z > 0.0 && z < c.z - radius) {
                ring += 1.0;
                beyond += f64::from(u8::from(z <= 0.0 || z > c.z + BEYOND * radius));
            }
        });
        let seen: f64 = on + through + before + HOLE * holes;
        let disc: f64 = on + through + before + holes + hidden;
        Evidence {
            cover: on / seen.max(1.0),
            through: through / seen.max(1.0),
            visible: on / disc.max(1.0),
            rim: rim.iter().filter(|seen| **seen).count() as f64 / rim.len() as f64,
            beyond: beyond / ring.max(1.0),
            misfit: 0.0,
            flatness: 0.0,
            roundness: 0.0,
            outline: 0.0,
            outline_misfit: 0.0,
            outline_radius: None,
            radius,
        }
    }
}

/// Octant of a direction.
fn octant(u: f64, v: f64) -> usize {
    usize::from(u > 0.0) + 2 * usize::from(v > 0.0) + 4 * usize::from(u.abs() > v.abs())
}

/// Returns the RMS distance of points from their best plane \[m\].
fn plane_rms(points: &[Vec3]) -> f64 {
    let n = points.len().max(1) as f64;
    let mean = points.iter().sum::<Vec3>() / n;
    let scatter: Mat3 = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    (SymmetricEigen::new(scatter).eigenvalues.min().max(0.0) / n).sqrt()
}
