//! Posterior of a sphere: the fit to the pixels on it, together with the prior of a fruit's radius.

use crate::cloud::Cloud;
use crate::config::DetectorConfig;
use crate::noise::Noise;
use crate::sphere::Sphere;
use nalgebra::{Matrix4, Vector4};
use orchard_geometry::Vec3;

/// Band in which pixels pull at the sphere, as a multiple of the noise band. Their weight falls smoothly to zero at its ends (Tukey's
/// biweight).
const PULL: f64 = 1.2;
/// First band over the radius of the sphere to start from; it is halved at each step.
const FIRST_BAND: f64 = 0.2;
/// Largest number of steps.
const STEPS: usize = 7;
/// Pixels along the radius of a sphere; of larger ones every second, third .. column and row is looked at.
const SAMPLES: f64 = 6.0;
/// A step of the centre below this ends the search \[m\].
const SETTLED: f64 = 5e-4;
/// Least sum of weights that determines a sphere.
const LEAST_WEIGHT: f64 = 8.0;
/// Least sum of weights over the pixels of the sphere's disc.
const LEAST_SHARE: f64 = 0.07;
/// Standard deviation of the centre without measurement, in those of the radius; it keeps the equations regular.
const FREE: f64 = 30.0;

/// Standard deviations of a sphere; infinite where pixels and prior do not determine it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Deviations {
    /// Of the centre's distance from its estimate \[m\].
    pub(crate) center: f64,
    /// Of the radius \[m\].
    pub(crate) radius: f64,
}

/// Estimates spheres in one image.
#[derive(Debug, Clone)]
pub(crate) struct Posterior {
    /// Mean and standard deviation of the radius \[m\]; `None` without a prior.
    prior: Option<(f64, f64)>,
    /// Largest number of pixels whose errors count as independent.
    independent: f64,
    noise: Noise,
}

impl Posterior {
    pub(crate) fn new(config: &DetectorConfig) -> Self {
        let prior = &config.fit.prior;
        Self {
            prior: config.fit.use_prior.then(|| (prior.mean.si(), prior.deviation.si())),
            independent: prior.independent.si(),
            noise: Noise::new(config),
        }
    }

    /// Returns the sphere of largest posterior probability next to a sphere, by Gauss and Newton's method; `None` if too few pixels lie on
    /// it. `accesses` takes the number of pixels looked at.
    pub(crate) fn settle(
        &self,
        cloud: &Cloud,
        start: &Sphere,
        mut accesses: impl FnMut(usize),
    ) -> Option<Sphere> {
        let mut sphere = *start;
        let mut widening = FIRST_BAND * start.radius;
        for _ in 0..STEPS {
            let narrowest = PULL * self.noise.band(sphere.center.z);
            let settled = widening <= narrowest;
            let (a, b) = self.equations(cloud, &sphere, widening.max(narrowest), &mut accesses)?;
            widening *= 0.5;
            let x = a.cholesky()?.solve(&b);
            let step = Vec3::new(x[0], x[1], x[2]);
            sphere = Sphere { center: sphere.center + step, radius: sphere.radius + x[3] };
            if !(sphere.radius > 0.0 && sphere.center.z > sphere.radius) {
                return None;
            }
            if settled && step.norm() < SETTLED {
                break;
            }
        }
        Some(sphere)
    }

    /// Returns the standard deviations of a sphere.
    pub(crate) fn deviations(&self, cloud: &Cloud, sphere: &Sphere) -> Deviations {
        let covariance = self
            .equations(cloud, sphere, PULL * self.noise.band(sphere.center.z), &mut |_| ())
            .and_then(|(a, _)| a.try_inverse());
        let deviation = |axes: &[usize]| {
            let variance = |c: &Matrix4<f64>| axes.iter().map(|&k| c[(k, k)]).sum::<f64>();
            covariance.as_ref().map_or(f64::INFINITY, |c| variance(c).max(0.0).sqrt())
        };
        Deviations { center: deviation(&[0, 1, 2]), radius: deviation(&[3]) }
    }

    /// Normal equations a x = b of a step x of centre and radius: those of the residuals |p - c| - R of the pixels near the sphere's near
    /// side, weighted by the noise, and of the prior.
    fn equations(
        &self,
        cloud: &Cloud,
        sphere: &Sphere,
        band: f64,
        accesses: &mut impl FnMut(usize),
    ) -> Option<(Matrix4<f64>, Vector4<f64>)> {
        let deviation = self.noise.deviation(sphere.center.z);
        // Sums of the weights, the weighted normals, the upper half of their outer products, and of both times the residual.
        let (mut weights, mut normals, mut products) = (0.0_f64, Vec3::zeros(), [0.0; 6]);
        let (mut residuals, mut pulls) = (0.0, Vec3::zeros());
        let radius_px = sphere.radius * cloud.focal / sphere.center.z;
        // A float-to-integer cast saturates.
        let spacing = ((radius_px / SAMPLES) as usize).clamp(1, cloud.width);
        let square = |x: f64| x * x;
        let (least, most) = (square((sphere.radius - band).max(0.0)), square(sphere.radius + band));
        let looked_at = cloud.sample_in_ball(&sphere.center, sphere.radius + band, spacing, |p| {
            let q = p - sphere.center;
            let distance = q.norm_squared();
            // Most pixels lie before or behind the sphere; a root is not taken for them.
            if distance < least || distance > most || q.dot(&p) > 0.0 {
                return;
            }
            let distance = distance.sqrt();
            let residual = distance - sphere.radius;
            let share = residual / band;
            let weight = (1.0 - share * share) * (1.0 - share * share);
            let n = q / distance;
            let weighted = n * weight;
            normals += weighted;
            let outer = [
                n.x * weighted.x,
                n.x * weighted.y,
                n.x * weighted.z,
                n.y * weighted.y,
                n.y * weighted.z,
                n.z * weighted.z,
            ];
            products.iter_mut().zip(outer).for_each(|(sum, x)| *sum += x);
            residuals += residual * weight;
            pulls += weighted * residual;
            weights += weight;
        });
        accesses(looked_at);
        let sampled = weights;
        weights *= (spacing * spacing) as f64;
        let disc = std::f64::consts::PI * radius_px * radius_px;
        if weights.is_nan() || weights < LEAST_WEIGHT.max(LEAST_SHARE * disc) {
            return None;
        }
        let each = (self.independent / weights).min(1.0) * (spacing * spacing) as f64;
        let scale = each / (deviation * deviation);
        let [xx, xy, xz, yy, yz, zz] = products;
        let [nx, ny, nz] = [normals.x, normals.y, normals.z];
        #[rustfmt::skip]
        let mut a = scale * Matrix4::new(
            xx, xy, xz, nx,
            xy, yy, yz, ny,
            xz, yz, zz, nz,
            nx, ny, nz, sampled,
        );
        let mut b = scale * Vector4::new(pulls.x, pulls.y, pulls.z, residuals);
        if let Some((mean, sd)) = self.prior {
            let precision = 1.0 / (sd * sd);
            a[(3, 3)] += precision;
            b[3] += (mean - sphere.radius) * precision;
            (0..3).for_each(|k| a[(k, k)] += precision / (FREE * FREE));
        }
        Some((a, b))
    }
}
