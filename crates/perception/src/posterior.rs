//! Posterior of a sphere: the fit to the pixels on it, together with the prior of a fruit's radius.

use crate::cloud::Cloud;
use crate::config::DetectorConfig;
use crate::noise::Noise;
use crate::sphere::Sphere;
use nalgebra::{Matrix4, Vector4};
use orchard_geometry::Vec3;

/// Band in which pixels pull at the sphere, as a multiple of the noise band. Their weight falls smoothly to zero at its ends (Tukey's
/// biweight).
const PULL: f64 = 1.5;
/// Largest number of steps.
const STEPS: usize = 8;
/// A step of the centre below this ends the search \[m\].
const SETTLED: f64 = 1e-4;
/// Least sum of weights that determines a sphere.
const LEAST_WEIGHT: f64 = 8.0;
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

    /// True if the radius has a prior.
    pub(crate) fn has_prior(&self) -> bool {
        self.prior.is_some()
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
        for _ in 0..STEPS {
            let (a, b) = self.equations(cloud, &sphere, &mut accesses)?;
            let x = a.cholesky()?.solve(&b);
            let step = Vec3::new(x[0], x[1], x[2]);
            sphere = Sphere { center: sphere.center + step, radius: sphere.radius + x[3] };
            if !(sphere.radius > 0.0 && sphere.center.z > sphere.radius) {
                return None;
            }
            if step.norm() < SETTLED {
                break;
            }
        }
        Some(sphere)
    }

    /// Returns the standard deviations of a sphere.
    pub(crate) fn deviations(&self, cloud: &Cloud, sphere: &Sphere) -> Deviations {
        let covariance = self.equations(cloud, sphere, &mut |_| ()).and_then(|(a, _)| a.try_inverse());
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
        accesses: &mut impl FnMut(usize),
    ) -> Option<(Matrix4<f64>, Vector4<f64>)> {
        let deviation = self.noise.deviation(sphere.center.z);
        let band = PULL * self.noise.band(sphere.center.z);
        let (mut a, mut b, mut weights) = (Matrix4::zeros(), Vector4::zeros(), 0.0_f64);
        let looked_at = cloud.usable_in_ball(&sphere.center, sphere.radius + band, |_, p| {
            let q = p - sphere.center;
            let distance = q.norm();
            let residual = distance - sphere.radius;
            if residual.abs() >= band || q.dot(&p) > 0.0 {
                return;
            }
            let share = residual / band;
            let weight = (1.0 - share * share) * (1.0 - share * share);
            let gradient = Vector4::new(q.x / distance, q.y / distance, q.z / distance, 1.0);
            a += gradient * gradient.transpose() * weight;
            b += gradient * (residual * weight);
            weights += weight;
        });
        accesses(looked_at);
        if weights.is_nan() || weights < LEAST_WEIGHT {
            return None;
        }
        let scale = (self.independent / weights).min(1.0) / (deviation * deviation);
        a *= scale;
        b *= scale;
        if let Some((mean, sd)) = self.prior {
            let precision = 1.0 / (sd * sd);
            a[(3, 3)] += precision;
            b[3] += (mean - sphere.radius) * precision;
            (0..3).for_each(|k| a[(k, k)] += precision / (FREE * FREE));
        }
        Some((a, b))
    }
}
