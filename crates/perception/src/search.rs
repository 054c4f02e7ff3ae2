//! Search for spheres within patches: fruit that touches leaves, twigs or other fruit.

use crate::cloud::{Cloud, Rectangle};
use crate::config::DetectorConfig;
use crate::noise::Noise;
use crate::sphere::{Moments, Sphere};
use std::cell::Cell;

/// Largest number of pixels that a local fit takes from the middle of its window to the edge; in wider windows they are evenly spaced.
/// Seventeen pixels a side are plenty for the four unknowns of a sphere.
const WINDOW_STEPS: usize = 8;

/// Sphere search in one image; lengths in SI units.
#[derive(Debug)]
pub(crate) struct Search<'a> {
    cloud: &'a Cloud,
    rounds: u32,
    trim: f64,
    window: f64,
    stride: usize,
    /// Radius of the smallest apple.
    smallest: f64,
    /// Interval of the radius gate; `None` if the gate is off.
    radius: Option<(f64, f64)>,
    noise: Noise,
    /// Number of pixel accesses left.
    effort: Cell<usize>,
}

/// A sphere and its support: the pixels that lie on it, row by row.
#[derive(Debug, Clone)]
pub(crate) struct Hypothesis {
    pub(crate) sphere: Sphere,
    pub(crate) support: Vec<usize>,
}

/// First fit of a sphere, through the points of a window.
struct Start {
    moments: Moments,
    sphere: Sphere,
    rms: f64,
}

impl<'a> Search<'a> {
    pub(crate) fn new(cloud: &'a Cloud, config: &DetectorConfig) -> Self {
        let c = &config.fit;
        Self {
            cloud,
            rounds: c.rounds.get(),
            trim: c.trim.si(),
            window: c.window.si(),
            stride: c.stride.get().max(1) as usize,
            smallest: config.gates.radius.limit.si().0,
            radius: config.gates.radius.si(),
            noise: Noise::new(config),
            effort: Cell::new(cloud.len().saturating_mul(c.effort.get() as usize)),
        }
    }

    /// Passes to `judge` the spheres found from the usable pixels of a grid, row by row. A pixel that supports a sphere starts no other
    /// fit. The search ends when its effort is spent.
    pub(crate) fn run(&self, mut judge: impl FnMut(Hypothesis)) {
        let mut explained = vec![false; self.cloud.len()];
        let image = Rectangle { u: (0, self.cloud.width), v: (0, self.cloud.height) };
        self.cloud.usable_in(image, self.stride, |seed, p| {
            if explained[seed] || self.effort.get() == 0 {
                return;
            }
            if let Some(h) = self.local(seed, &p).and_then(|start| self.refined(start)) {
                h.support.iter().for_each(|&i| explained[i] = true);
                judge(h);
            }
        });
    }

    /// Fits a sphere to the window about one pixel; `None` if the sphere cannot be a fruit.
    fn local(&self, seed: usize, p_seed: &orchard_geometry::Vec3) -> Option<Start> {
        let z = p_seed.z;
        let half = (self.window * self.smallest * self.cloud.focal / z).round().max(1.0);
        let step = (half / WINDOW_STEPS as f64).ceil().max(1.0);
        let half = (half / step).floor() * step;
        let (u, v) = self.cloud.uv(seed);
        let jump = self.noise.jump(z);
        let mut moments = Moments::about(*p_seed);
        let window = self.cloud.rectangle((u as f64, v as f64), (half, half));
        self.spend((2 * WINDOW_STEPS + 1).pow(2).min(window.count()));
        self.cloud.usable_in(window, step as usize, |_, p| {
            if (p.z - z).abs() <= jump {
                moments.add(&p);
            }
        });
        let (sphere, rms) = moments.sphere()?;
        let plausible = self.radius_plausible(&sphere) && rms <= self.noise.band(z);
        plausible.then_some(Start { moments, sphere, rms })
    }

    /// Collects all pixels on the sphere, fits again and narrows the band, until the band is the noise band and the support is stable.
    /// Occluders may cut the support into several pieces.
    fn refined(&self, start: Start) -> Option<Hypothesis> {
        let Start { mut moments, mut sphere, rms } = start;
        let narrowest = |sphere: &Sphere| self.noise.band(sphere.center.z);
        let mut band = (self.trim * rms).max(narrowest(&sphere));
        for _ in 0..self.rounds {
            let mut next = Moments::about(moments.origin());
            self.on_sphere(&sphere, band, |_, p| next.add(&p));
            // Equal sums mean equal points.
            let settled = band <= narrowest(&sphere) && next == moments;
            if settled {
                break;
            }
            moments = next;
            sphere = moments.sphere()?.0;
            if !self.radius_plausible(&sphere) {
                return None;
            }
            band = (0.5 * band).max(narrowest(&sphere));
        }
        let mut support = Vec::new();
        self.on_sphere(&sphere, band, |i, _| support.push(i));
        (sphere.center.z > 0.0).then_some(Hypothesis { sphere, support })
    }

    /// True if the radius lies between half the lower and twice the upper limit: a first fit from few pixels is rough.
    fn radius_plausible(&self, sphere: &Sphere) -> bool {
        self.radius.is_none_or(|(low, high)| (0.5 * low..=2.0 * high).contains(&sphere.radius))
    }

    /// Calls `f` with index and point of the usable pixels within `band` \[m\] of the sphere, row by row.
    fn on_sphere(&self, sphere: &Sphere, band: f64, mut f: impl FnMut(usize, orchard_geometry::Vec3)) {
        let (least, most) = ((sphere.radius - band).max(0.0), sphere.radius + band);
        let (least, most) = (least * least, most * most);
        let accesses = self.cloud.usable_in_ball(&sphere.center, sphere.radius + band, |i, p| {
            let square = (p - sphere.center).norm_squared();
            if square >= least && square <= most {
                f(i, p);
            }
        });
        self.spend(accesses);
    }

    fn spend(&self, pixels: usize) {
        self.effort.set(self.effort.get().saturating_sub(pixels));
    }
}
