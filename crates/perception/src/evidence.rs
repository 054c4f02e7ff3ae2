//! Evidence for and against a sphere: how well the pixels of its disc and those around it agree with a fruit.

use crate::cloud::{Cloud, Pixel, Row};
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

    /// Measures the evidence for a sphere; returns it with the root mean square of the radial residual \[m\].
    pub(crate) fn examine(&self, cloud: &Cloud, hypothesis: &Hypothesis) -> (Evidence, f64) {
        let Hypothesis { sphere, support } = hypothesis;
        let hides = self.hides.max(self.noise.band(sphere.center.z));
        let outline = outline::trace(cloud, sphere, hides);
        let shares = self.shares(cloud, hypothesis, hides);
        let points = cloud.points(support);
        let rms = sphere.rms(points.iter().copied());
        let ratio = |a: f64, b: f64| if b > 0.0 { (a / b).min(LARGEST_RATIO) } else { LARGEST_RATIO };
        let metres = |px: f64| px * sphere.center.z / cloud.focal;
        let evidence = Evidence {
            misfit: ratio(rms, self.noise.deviation(sphere.center.z)),
            flatness: ratio(rms, plane_rms(&points)),
            roundness: ratio(rms, cylinder::best_rms(&points)),
            outline: outline.ended,
            outline_misfit: outline.circle.map_or(1.0, |circle| circle.rms / circle.radius),
            outline_radius: outline.circle.map(|circle| metres(circle.radius)),
            radius: sphere.radius,
            ..shares
        };
        (evidence, rms)
    }

    /// Measures the shares of disc and ring; the other fields are zero. The ramp that the camera makes of an edge counts for neither.
    fn shares(&self, cloud: &Cloud, hypothesis: &Hypothesis, hides: f64) -> Evidence {
        let (c, radius) = (&hypothesis.sphere.center, hypothesis.sphere.radius);
        let band = self.noise.band(c.z);
        let ramp = (self.ramp * c.z / (radius * cloud.focal)).min(WIDEST_RAMP);
        let (center_u, center_v) = cloud.intrinsics.project(c).unwrap_or((0.0, 0.0));
        let square = |x: f64| x * x;
        let (c_square, r_square, near_rim) = (c.norm_squared(), square(radius), square(radius * NEAR_RIM));
        let widest = square(band) * r_square;
        let mut n = Counts::default();
        let mut rim = [false; 8];
        let disc = |row: Row<'_>| {
            let below = row.v as f64 - center_v;
            // Pixels on the sphere near its rim, by side and by whether they are farther aside than below.
            let mut rims = [0_u32; 4];
            for (((&z, &x), &pixel), k) in row.z.iter().zip(row.x).zip(row.pixels).zip(0_u32..) {
                // No branch depends on a pixel. The ray's nearest point to the centre is ray * along / ray_square.
                let ray = Vec3::new(x, row.y, 1.0);
                let (along, ray_square) = (ray.dot(c), ray.norm_squared());
                let inverse = 1.0 / ray_square;
                let off_square = c_square - along * along * inverse;
                let half_chord = (r_square - off_square).max(0.0);
                let z_sphere = along * inverse - (half_chord * inverse).sqrt();
                let empty = z <= 0.0;
                let hides = !empty & ((pixel == Pixel::Masked) | (z < z_sphere - hides));
                let seen = !empty & !hides;
                // Square of the residual along the normal, times that of the radius.
                let on = seen & (square(z - z_sphere) * half_chord <= widest);
                n.holes += u32::from(empty);
                n.hidden += u32::from(hides);
                n.on += u32::from(on);
                n.through += u32::from(seen & !on & (z > z_sphere));
                n.before += u32::from(seen & !on & (z <= z_sphere));
                let aside = (row.u as f64 + f64::from(k)) - center_u;
                let place = usize::from(aside > 0.0) + 2 * usize::from(aside.abs() > below.abs());
                rims[place] += u32::from(on & (off_square > near_rim));
            }
            for (k, _) in rims.iter().enumerate().filter(|(_, count)| **count > 0) {
                rim[2 * k + usize::from(below > 0.0)] = true;
            }
        };
        let (front, behind) = (c.z - radius, c.z + BEYOND * radius);
        let (mut in_ring, mut in_beyond) = (0_u32, 0_u32);
        let ring = |row: Row<'_>| {
            for &z in row.z {
                let empty = z <= 0.0;
                in_ring += u32::from(empty | (z >= front));
                in_beyond += u32::from(empty | (z > behind));
            }
        };
        cloud.disc_and_ring(c, [1.0 - ramp, 1.0 + ramp, RING].map(|share| share * radius), disc, ring);
        (n.ring, n.beyond) = (in_ring, in_beyond);
        let [on, hidden, through, before, holes, ring, beyond] =
            [n.on, n.hidden, n.through, n.before, n.holes, n.ring, n.beyond].map(f64::from);
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

/// Numbers of pixels of disc and ring.
#[derive(Debug, Default)]
struct Counts {
    on: u32,
    hidden: u32,
    through: u32,
    before: u32,
    holes: u32,
    ring: u32,
    beyond: u32,
}

/// Returns the RMS distance of points from their best plane \[m\].
fn plane_rms(points: &[Vec3]) -> f64 {
    let n = points.len().max(1) as f64;
    let mean = points.iter().sum::<Vec3>() / n;
    let mut sums = [0.0; 6];
    for p in points {
        let q = p - mean;
        let products = [q.x * q.x, q.x * q.y, q.x * q.z, q.y * q.y, q.y * q.z, q.z * q.z];
        sums.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
    }
    let [xx, xy, xz, yy, yz, zz] = sums;
    let scatter = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    (SymmetricEigen::new(scatter).eigenvalues.min().max(0.0) / n).sqrt()
}
