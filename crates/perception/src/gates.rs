//! Gates: the conditions that a candidate sphere must satisfy.

use crate::cloud::{Cloud, Pixel};
use crate::config::DetectorConfig;
use crate::cylinder;
use crate::noise::Noise;
use crate::sphere::Sphere;
use orchard_geometry::Vec3;

/// The gates, in the order in which they are applied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Gate {
    /// Too few pixels.
    MinPixels,
    /// The radius is not that of an apple.
    Radius,
    /// The pixel count does not agree with that of the sphere's disc.
    PixelRatio,
    /// The RMS residual of the fit is too large.
    Residual,
    /// The surface bulges away from the camera.
    Convexity,
    /// The footprint is too long.
    Elongation,
    /// The surface continues beyond the silhouette.
    Isolation,
    /// A cylinder fits better.
    Cylinder,
    /// The evidence speaks against a fruit.
    Score,
}

impl Gate {
    /// Name of the gate in config files.
    pub fn name(self) -> &'static str {
        match self {
            Gate::MinPixels => "min_pixels",
            Gate::Radius => "radius",
            Gate::Residual => "residual",
            Gate::Convexity => "convexity",
            Gate::PixelRatio => "pixel_ratio",
            Gate::Elongation => "elongation",
            Gate::Isolation => "isolation",
            Gate::Cylinder => "cylinder",
            Gate::Score => "score",
        }
    }
}

impl std::fmt::Display for Gate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Limits of the gates in SI units; `None` where a gate is off.
#[derive(Debug, Clone)]
pub(crate) struct Limits {
    pub(crate) min_pixels: usize,
    noise: Noise,
    radius: Option<(f64, f64)>,
    residual: Option<f64>,
    convexity: Option<f64>,
    pixel_ratio: Option<(f64, f64)>,
    elongation: Option<f64>,
    isolation: Option<f64>,
    cylinder: Option<f64>,
    hidden: Option<f64>,
}

impl Limits {
    pub(crate) fn new(config: &DetectorConfig) -> Self {
        let g = &config.gates;
        Self {
            min_pixels: config.segmentation.min_pixels.get() as usize,
            noise: Noise::new(config),
            radius: g.radius.si(),
            residual: g.residual.si(),
            convexity: g.convexity.si(),
            pixel_ratio: g.pixel_ratio.si(),
            elongation: g.elongation.si(),
            isolation: g.isolation.si(),
            cylinder: g.cylinder.si(),
            hidden: g.hidden.si(),
        }
    }

    /// Returns the first gate that refuses a sphere with the given support pixels; cheap gates come first. `marks` is scratch memory, one
    /// entry per pixel, all false before and after the call.
    pub(crate) fn refusal(
        &self,
        cloud: &Cloud,
        sphere: &Sphere,
        support: &[usize],
        marks: &mut [bool],
    ) -> Option<Gate> {
        // NaN lies in no interval, so it is refused.
        let outside = |limit: (f64, f64), value: f64| !(limit.0..=limit.1).contains(&value);
        if support.len() < self.min_pixels {
            return Some(Gate::MinPixels);
        }
        if self.radius.is_some_and(|r| outside(r, sphere.radius)) {
            return Some(Gate::Radius);
        }
        if self.pixel_ratio.is_some_and(|r| outside(r, pixel_ratio(cloud, sphere, support.len()))) {
            return Some(Gate::PixelRatio);
        }
        let points = cloud.points(support);
        let rms = || sphere.rms(points.iter().copied());
        if self.residual.is_some_and(|most| outside((0.0, most), rms())) {
            return Some(Gate::Residual);
        }
        if self.convexity.is_some_and(|least| outside((least, 1.0), convexity(sphere, &points))) {
            return Some(Gate::Convexity);
        }
        let hides = self.hidden.map(|least| least.max(self.noise.growing(sphere.center.z)));
        if self.elongation.is_some_and(|most| outside((0.0, most), elongation(cloud, sphere, support, hides)))
        {
            return Some(Gate::Elongation);
        }
        let jump = |z| self.noise.jump(z);
        let mut isolation = || isolation(cloud, sphere, support, jump, hides, marks);
        if self.isolation.is_some_and(|least| outside((least, 1.0), isolation())) {
            return Some(Gate::Isolation);
        }
        let cylinder_fits_better = |margin: f64| rms() > margin * cylinder::best_rms(&points);
        if self.cylinder.is_some_and(cylinder_fits_better) {
            return Some(Gate::Cylinder);
        }
        None
    }
}

/// Returns the mean cosine between the sphere's outward normal and the direction to the camera: 2/3 for the visible half of a ball,
/// negative for a bowl.
fn convexity(sphere: &Sphere, points: &[Vec3]) -> f64 {
    let cosine = |p: &Vec3| {
        let n = p - sphere.center;
        -n.dot(p) / (n.norm_squared() * p.norm_squared()).sqrt()
    };
    points.iter().map(cosine).sum::<f64>() / points.len() as f64
}

/// Returns the pixel count divided by that of the sphere's disc, pi (R f / z)^2.
fn pixel_ratio(cloud: &Cloud, sphere: &Sphere, pixels: usize) -> f64 {
    let radius_px = sphere.radius * cloud.focal / sphere.center.z;
    pixels as f64 / (std::f64::consts::PI * radius_px * radius_px)
}

/// Least variance of a support across its length [px^2], between that of two rows of pixels, 1/4, and that of three, 2/3. Two rows across
/// a cylinder are equal circles, which lie exactly on a sphere, so that a cylinder cannot be told from a sphere.
const TWO_ROWS: f64 = 0.4;

/// Returns the ratio of the footprint's principal second moments: the square of the elongation, 1 for a disc. Pixels of the sphere's disc
/// whose measured depth is at least `hides` \[m\] in front of the sphere are hidden pixels and count as footprint. Returns infinity if the
/// support is too narrow to show a sphere.
fn elongation(cloud: &Cloud, sphere: &Sphere, support: &[usize], hides: Option<f64>) -> f64 {
    let mut footprint = Footprint::about(cloud.uv(support[support.len() / 2]));
    support.iter().for_each(|&i| footprint.add(cloud.uv(i)));
    if footprint.variances().1 < TWO_ROWS {
        return f64::INFINITY;
    }
    if let Some(hides) = hides {
        cloud.disc_of_ball(&sphere.center, sphere.radius, |i, z_sphere| {
            if is_in_front(cloud.z(i), z_sphere, hides) {
                footprint.add(cloud.uv(i));
            }
        });
    }
    let (along, across) = footprint.variances();
    along / across
}

/// Second moments of a set of pixels, exact: integer sums relative to a pixel near the middle.
struct Footprint {
    origin: (usize, usize),
    sums: [i64; 6],
}

impl Footprint {
    fn about(origin: (usize, usize)) -> Self {
        Self { origin, sums: [0; 6] }
    }

    fn add(&mut self, (u, v): (usize, usize)) {
        let (u, v) = (u as i64 - self.origin.0 as i64, v as i64 - self.origin.1 as i64);
        let terms = [1, u, v, u * u, u * v, v * v];
        self.sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }

    /// Returns the largest and the least variance over all directions [px^2].
    fn variances(&self) -> (f64, f64) {
        let [n, su, sv, suu, suv, svv] = self.sums.map(|x| x as f64);
        let (a, b, c) = (suu - su * su / n, suv - su * sv / n, svv - sv * sv / n);
        let (mid, half) = (0.5 * (a + c), (0.25 * (a - c) * (a - c) + b * b).sqrt());
        ((mid + half) / n, (mid - half).max(0.0) / n)
    }
}

/// True if a measured depth is at least `hides` in front of the sphere, all in \[m\].
fn is_in_front(z: f64, z_sphere: f64, hides: f64) -> bool {
    z > 0.0 && z <= z_sphere - hides
}

/// Returns the share of the support's border at which the surface ends: the next pixel has no measurement or differs in depth by more
/// than `jump`, to the front or to the back. Border without evidence is left out: the image's edge and, where depth does not jump,
/// masked pixels (the surface may continue under a finger or into the ground) and hidden pixels, at least `hides` \[m\] in front of the
/// sphere.
fn isolation(
    cloud: &Cloud,
    sphere: &Sphere,
    support: &[usize],
    jump: impl Fn(f64) -> f64,
    hides: Option<f64>,
    marks: &mut [bool],
) -> f64 {
    let hidden = |j: usize| {
        let z_sphere = hides.and_then(|_| cloud.z_of_ball(j, &sphere.center, sphere.radius));
        hides.zip(z_sphere).is_some_and(|(hides, z_sphere)| is_in_front(cloud.z(j), z_sphere, hides))
    };
    support.iter().for_each(|&i| marks[i] = true);
    let (mut border, mut free) = (0_usize, 0_usize);
    for &i in support {
        for j in cloud.neighbours(i).into_iter().flatten() {
            if marks[j] {
                continue;
            }
            // A pixel without a measurement has z = 0.
            let ends = (cloud.z(i) - cloud.z(j)).abs() > jump(cloud.z(i));
            let unknown = !ends && (cloud.pixel(j) == Pixel::Masked || hidden(j));
            border += usize::from(!unknown);
            free += usize::from(ends);
        }
    }
    support.iter().for_each(|&i| marks[i] = false);
    free as f64 / border.max(1) as f64
}
