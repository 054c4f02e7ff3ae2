//! Spheres within patches: fruit that touches leaves, twigs or other fruit.

use crate::cloud::{Cloud, Pixel};
use crate::config::DetectorConfig;
use crate::sphere::Sphere;
use orchard_geometry::Vec3;

/// The search's parameters in SI units.
#[derive(Debug, Clone)]
pub(crate) struct Search {
    pub(crate) refine: bool,
    rounds: u32,
    trim: f64,
    band: f64,
    window: f64,
    stride: usize,
    radius: (f64, f64),
}

/// A sphere and the pixels that it explains.
#[derive(Debug, Clone)]
pub(crate) struct Hypothesis {
    pub(crate) sphere: Sphere,
    pub(crate) support: Vec<usize>,
}

impl Search {
    pub(crate) fn new(config: &DetectorConfig) -> Self {
        let c = &config.fit;
        Self {
            refine: c.refine,
            rounds: c.rounds.get(),
            trim: c.trim.si(),
            band: c.band.si(),
            window: c.window.si(),
            stride: c.stride.get() as usize,
            radius: config.gates.radius.limit.si(),
        }
    }

    /// The least-squares sphere of a whole patch.
    pub(crate) fn whole(&self, cloud: &Cloud, patch: &[usize]) -> Option<Hypothesis> {
        let sphere = Sphere::fit(points(cloud, patch))?;
        Some(Hypothesis { sphere, support: patch.to_vec() })
    }

    /// Pixels of the patch from which a local sphere is tried.
    pub(crate) fn seeds(&self, cloud: &Cloud, patch: &[usize]) -> Vec<usize> {
        let on_grid = |&i: &usize| {
            let (u, v) = cloud.uv(i);
            u % self.stride == 0 && v % self.stride == 0
        };
        patch.iter().copied().filter(on_grid).collect()
    }

    /// The sphere through the surroundings of one pixel, if it could be a fruit.
    pub(crate) fn local(&self, cloud: &Cloud, seed: usize, jump: f64) -> Option<Hypothesis> {
        let z = cloud.points[seed].z;
        let half = (self.window * self.radius.0 * cloud.focal / z).round().max(1.0);
        let (u, v) = cloud.uv(seed);
        let mut support = Vec::new();
        cloud.usable_around((u as f64, v as f64), (half, half), |i| {
            if (cloud.points[i].z - z).abs() <= jump {
                support.push(i);
            }
        });
        let sphere = Sphere::fit(points(cloud, &support))?;
        let plausible = self.radius_plausible(&sphere) && sphere.rms(points(cloud, &support)) <= self.band;
        plausible.then_some(Hypothesis { sphere, support })
    }

    /// Looks for all pixels on the sphere, fits again, and narrows the band, until it is the noise band and
    /// the support is stable. Occluders may cut the support into several pieces.
    pub(crate) fn refined(&self, cloud: &Cloud, start: Hypothesis) -> Option<Hypothesis> {
        let mut h = start;
        let mut band = (self.trim * h.sphere.rms(points(cloud, &h.support))).max(self.band);
        for _ in 0..self.rounds {
            let support = self.on_sphere(cloud, &h.sphere, band);
            let narrowest = band <= self.band;
            if narrowest && support == h.support {
                break;
            }
            h = Hypothesis { sphere: Sphere::fit(points(cloud, &support))?, support };
            if !self.radius_plausible(&h.sphere) {
                return None;
            }
            band = (0.5 * band).max(self.band);
        }
        Some(h)
    }

    /// Half to twice the allowed interval: a first fit from few pixels is rough.
    fn radius_plausible(&self, sphere: &Sphere) -> bool {
        (0.5 * self.radius.0..=2.0 * self.radius.1).contains(&sphere.radius)
    }

    /// Usable pixels within `band` of the sphere's near side, row by row.
    fn on_sphere(&self, cloud: &Cloud, sphere: &Sphere, band: f64) -> Vec<usize> {
        let mut support = Vec::new();
        let k = &cloud.intrinsics;
        let Some(center) = k.project(&sphere.center) else { return support };
        // The silhouette of a sphere off the axis is a little wider than R f / z: take the nearest depth.
        let z = (sphere.center.z - sphere.radius).max(0.25 * sphere.center.z);
        let reach = (sphere.radius + band) / z;
        cloud.usable_around(center, (k.fx * reach, k.fy * reach), |i| {
            if sphere.residual(&cloud.points[i]).abs() <= band {
                support.push(i);
            }
        });
        support
    }
}

fn points<'a>(cloud: &'a Cloud, support: &'a [usize]) -> impl Iterator<Item = Vec3> + Clone + 'a {
    support.iter().map(|&i| cloud.points[i])
}

/// Pixels that no accepted sphere explains yet.
pub(crate) struct Unexplained(Vec<bool>);

impl Unexplained {
    pub(crate) fn new(cloud: &Cloud) -> Self {
        Self(cloud.pixels.iter().map(|&p| p == Pixel::Usable).collect())
    }

    pub(crate) fn contains(&self, i: usize) -> bool {
        self.0[i]
    }

    pub(crate) fn remove(&mut self, support: &[usize]) {
        for &i in support {
            self.0[i] = false;
        }
    }
}
