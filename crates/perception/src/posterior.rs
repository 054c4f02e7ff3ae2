//! Posterior of a sphere: the fit to the pixels on it, together with the prior of a fruit's radius.

use crate::cloud::{Cloud, LANES};
use crate::config::DetectorConfig;
use crate::noise::Noise;
use crate::sphere::Sphere;
use nalgebra::{Matrix4, Vector4};
use orchard_geometry::Vec3;

/// Band in which pixels pull at the sphere, as a multiple of the noise band. Their weight falls smoothly to zero at its ends (Tukey's
/// biweight).
const PULL: f64 = 1.2;
/// Largest distance by which a pixel's ray may pass a sphere by, as a share of the band.
const BESIDE: f64 = 0.5;
/// First band over the radius of the sphere to start from; it is halved at each step.
const FIRST_BAND: f64 = 0.2;
/// Largest number of steps.
const STEPS: usize = 7;
/// Pixels along the radius of a sphere; of larger ones every second, third .. column and row is looked at.
const SAMPLES: f64 = 6.0;
/// A sphere that slides along a plane has moved from its start by more than this share of the start's radius and this many standard
/// deviations of the depth noise.
const SLID: f64 = 0.5;
const SLID_DEVIATIONS: f64 = 2.0;
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
    /// Movement of the centre for each metre by which the radius is changed, so that the pixels stay on the sphere.
    pub(crate) center_per_radius: Vec3,
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
            if !(sphere.radius > 0.0 && sphere.center.z > sphere.radius) || self.slides(start, &sphere) {
                return None;
            }
            if settled && step.norm() < SETTLED {
                break;
            }
        }
        Some(sphere)
    }

    /// True if a sphere slides along a plane, where it moves away from its start and grows until the prior holds it: larger than the
    /// prior's mean by more than a standard deviation.
    fn slides(&self, start: &Sphere, sphere: &Sphere) -> bool {
        let far = SLID * start.radius + SLID_DEVIATIONS * self.noise.deviation(sphere.center.z);
        self.prior.is_some_and(|(mean, sd)| sphere.radius > mean + sd)
            && (sphere.center - start.center).norm() > far
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
        let moved = |c: &Matrix4<f64>| Vec3::new(c[(0, 3)], c[(1, 3)], c[(2, 3)]) / c[(3, 3)];
        Deviations {
            center: deviation(&[0, 1, 2]),
            radius: deviation(&[3]),
            center_per_radius: covariance.as_ref().map_or(Vec3::zeros(), moved),
        }
    }

    /// Normal equations a x = b of a step x of centre and radius: those of the residuals |p - c| - R of the pixels near the sphere's near
    /// side, weighted by the noise, and of the prior. Pixels whose rays pass the sphere by at a distance are left out, however near
    /// their points: edges are blurred there.
    fn equations(
        &self,
        cloud: &Cloud,
        sphere: &Sphere,
        band: f64,
        accesses: &mut impl FnMut(usize),
    ) -> Option<(Matrix4<f64>, Vector4<f64>)> {
        let deviation = self.noise.deviation(sphere.center.z);
        let radius_px = sphere.radius * cloud.focal / sphere.center.z;
        // A float-to-integer cast saturates.
        let spacing = ((radius_px / SAMPLES) as usize).clamp(1, cloud.width);
        let mut sums = Sums::new(sphere, band);
        let looked_at =
            cloud.sample_in_ball(&sphere.center, sphere.radius + BESIDE * band, spacing, |z, x, y| {
                sums.add(z, x, y);
            });
        accesses(looked_at);
        let [sampled, nx, ny, nz, xx, xy, xz, yy, yz, zz, residuals, px, py, pz] = sums.total();
        let pixels_each = (spacing * spacing) as f64;
        let weights = sampled * pixels_each;
        let disc = std::f64::consts::PI * radius_px * radius_px;
        if weights.is_nan() || weights < LEAST_WEIGHT.max(LEAST_SHARE * disc) {
            return None;
        }
        let each = (self.independent / weights).min(1.0) * pixels_each;
        let scale = each / (deviation * deviation);
        #[rustfmt::skip]
        let mut a = scale * Matrix4::new(
            xx, xy, xz, nx,
            xy, yy, yz, ny,
            xz, yz, zz, nz,
            nx, ny, nz, sampled,
        );
        let mut b = scale * Vector4::new(px, py, pz, residuals);
        if let Some((mean, sd)) = self.prior {
            let precision = 1.0 / (sd * sd);
            a[(3, 3)] += precision;
            b[3] += (mean - sphere.radius) * precision;
            (0..3).for_each(|k| a[(k, k)] += precision / (FREE * FREE));
        }
        Some((a, b))
    }
}

/// Number of sums.
const SUMS: usize = 14;

/// Sums over the pixels within a band of a sphere's near side, several side by side: of the weights, the weighted normals, the upper half
/// of their outer products, and of weights and weighted normals times the residual. Half the digits do: they are a thousandth of the
/// noise.
struct Sums {
    center: [f32; 3],
    radius: f32,
    per_band: f32,
    least: f32,
    most: f32,
    sums: [[f32; LANES]; SUMS],
}

impl Sums {
    fn new(sphere: &Sphere, band: f64) -> Self {
        let square = |x: f64| (x * x) as f32;
        let c = &sphere.center;
        Self {
            center: [c.x as f32, c.y as f32, c.z as f32],
            radius: sphere.radius as f32,
            per_band: (1.0 / band) as f32,
            least: square((sphere.radius - band).max(0.0)).max(f32::MIN_POSITIVE),
            most: square(sphere.radius + band),
            sums: [[0.0; LANES]; SUMS],
        }
    }

    /// Adds pixels of one row with depths z \[m\] and slopes x = X/z, y = Y/z. No branch depends on a pixel, so that the compiler can take
    /// all lanes at once; inlined into a loop, it would take the sums apart again.
    #[inline(never)]
    fn add(&mut self, zs: &[f32], xs: &[f32], y: f32) {
        let (Some(zs), Some(xs)) = (zs.first_chunk::<LANES>(), xs.first_chunk::<LANES>()) else { return };
        let [cx, cy, cz] = self.center;
        let (mut qx, mut qy, mut qz) = ([0.0_f32; LANES], [0.0_f32; LANES], [0.0_f32; LANES]);
        let (mut square, mut counts) = ([0.0_f32; LANES], [0_u32; LANES]);
        for lane in 0..LANES {
            let (z, x) = (zs[lane], xs[lane]);
            (qx[lane], qy[lane], qz[lane]) = (x * z - cx, y * z - cy, z - cz);
            square[lane] = qx[lane] * qx[lane] + qy[lane] * qy[lane] + qz[lane] * qz[lane];
            // The near side: the normal points towards the camera.
            let along = qx[lane] * x + qy[lane] * y + qz[lane];
            let inside =
                (z > 0.0) & (square[lane] >= self.least) & (square[lane] <= self.most) & (along <= 0.0);
            counts[lane] = if inside { u32::MAX } else { 0 };
        }
        // Most pixels lie before or behind the sphere.
        if counts.iter().fold(0, |any, count| any | count) == 0 {
            return;
        }
        let mut terms = [[0.0_f32; LANES]; SUMS];
        for lane in 0..LANES {
            let distance = square[lane].max(f32::MIN_POSITIVE).sqrt();
            let inverse = 1.0 / distance;
            let residual = distance - self.radius;
            let share = residual * self.per_band;
            let inner = 1.0 - share * share;
            let weight = f32::from_bits((inner * inner).to_bits() & counts[lane]);
            let (nx, ny, nz) = (qx[lane] * inverse, qy[lane] * inverse, qz[lane] * inverse);
            let (wx, wy, wz) = (nx * weight, ny * weight, nz * weight);
            terms[0][lane] = weight;
            terms[1][lane] = wx;
            terms[2][lane] = wy;
            terms[3][lane] = wz;
            terms[4][lane] = nx * wx;
            terms[5][lane] = nx * wy;
            terms[6][lane] = nx * wz;
            terms[7][lane] = ny * wy;
            terms[8][lane] = ny * wz;
            terms[9][lane] = nz * wz;
            terms[10][lane] = residual * weight;
            terms[11][lane] = residual * wx;
            terms[12][lane] = residual * wy;
            terms[13][lane] = residual * wz;
        }
        for (sums, terms) in self.sums.iter_mut().zip(&terms) {
            for lane in 0..LANES {
                sums[lane] += terms[lane];
            }
        }
    }

    fn total(&self) -> [f64; SUMS] {
        self.sums.map(|lanes| lanes.iter().map(|x| f64::from(*x)).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_geometry::{DepthImage, Image, Intrinsics};

    const BALL: Sphere = Sphere { center: Vec3::new(0.02, -0.03, 2.0), radius: 0.036 };

    const WALL: f64 = 2.8;

    /// A ball before a wall, or the wall alone.
    fn cloud(k: &Intrinsics, ball: bool) -> Cloud {
        let mut depth: DepthImage = Image::filled(k.width, k.height, WALL as f32);
        for v in 0..k.height {
            for u in 0..k.width {
                let ray = k.ray(u as f64, v as f64);
                let (along, square) = (ray.dot(&BALL.center), ray.norm_squared());
                let root = along * along - square * (BALL.center.norm_squared() - BALL.radius * BALL.radius);
                if ball && root >= 0.0 {
                    depth[(u, v)] = ((along - root.sqrt()) / square) as f32;
                }
            }
        }
        Cloud::new(&depth, k, None, (0.3, 3.0), 1).unwrap()
    }

    #[test]
    fn a_sphere_settles_on_a_ball_and_is_given_up_on_a_wall() {
        let k = Intrinsics::from_vertical_fov(640, 576, 1.13);
        let posterior = Posterior::new(&DetectorConfig::named("azure-kinect-native").unwrap());
        let start = Sphere { center: BALL.center + Vec3::new(0.004, -0.003, 0.005), radius: 0.035 };
        let found = posterior.settle(&cloud(&k, true), &start, |_| ()).unwrap();
        assert!((found.center - BALL.center).norm() < 2e-3, "{found:?}");
        assert!((found.radius - BALL.radius).abs() < 2e-3, "{found:?}");
        let wall = cloud(&k, false);
        let on_wall = Sphere { center: Vec3::new(0.02, -0.03, WALL + 0.01), radius: 0.035 };
        assert_eq!(posterior.settle(&wall, &on_wall, |_| ()), None);
    }
}
