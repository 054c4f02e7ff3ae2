//! Measurement of a time-of-flight camera from a true depth image, step by step.
//!
//! Equations, figures and limits: `docs/computation/sensor.md`.

use super::ImageKey;
use super::noise::Field;
use orchard_geometry::{DepthImage, Image, math};
use orchard_spec::camera::TimeOfFlightSpec;
use orchard_spec::{Purpose, Stream};

/// Rays along each side of a pixel over which its light is summed.
pub(super) const RAYS: usize = 2;
/// Number of standard deviations at which the blur ends.
const BLUR_END: f64 = 3.0;

/// Returns the measured depth \[m\], 0 without a measurement. `truth` is the true depth at any range, 0 where there is no surface, with
/// [`RAYS`] pixels for each pixel along each side.
pub(super) fn measure(spec: &TimeOfFlightSpec, truth: &DepthImage, key: ImageKey) -> DepthImage {
    let light = Light::of(truth).blurred(spec.blur.si());
    let (width, height) = (light.width, light.height);
    let mut stream = Stream::of_frame(key.seed, key.world, key.frame, Purpose::SensorNoise);
    let window = spec.noise_window.get() as usize;
    let noise = Field::draw(&mut stream, (width, height), window, 1);
    let need = Field::draw(&mut stream, (width, height), window, 1);
    let (floor, at_metre) = (spec.noise_floor.si(), spec.noise_at_metre());
    let (mixing, spread) = (spec.mixing.si(), spec.reach_spread.si());
    let least = 1.0 / (spec.reach() * spec.reach());
    let (near, far) = spec.range.si();
    let mut measured = Image::filled(width, height, 0.0_f32);
    for (i, z) in measured.pixels_mut().iter_mut().enumerate() {
        let [returned, first, second] = light.sums[i];
        if returned <= least * (1.0 + spread * f64::from(need.at(i))).max(f64::EPSILON) {
            continue;
        }
        let mean = first / returned;
        let variance = (second / returned - mean * mean).max(0.0);
        // Light falls with the square of the distance: a surface that fills the pixel has an error of `at_metre` z^2.
        let sd = math::hypot(floor, at_metre / returned);
        let depth = mean + sd * f64::from(noise.at(i));
        if variance <= mixing * mixing && (near..=far).contains(&depth) {
            *z = depth as f32;
        }
    }
    measured
}

/// Light that returns to each pixel, with its first two moments of depth: sums of a, a z and a z^2 with a = 1 / z^2.
struct Light {
    width: usize,
    height: usize,
    sums: Vec<[f64; 3]>,
}

impl Light {
    /// Means over the rays of each pixel.
    fn of(truth: &DepthImage) -> Self {
        let (width, height) = (truth.width() / RAYS, truth.height() / RAYS);
        let mut sums = vec![[0.0; 3]; width * height];
        let share = 1.0 / (RAYS * RAYS) as f64;
        for v in 0..height * RAYS {
            for u in 0..width * RAYS {
                let z = f64::from(truth[(u, v)]);
                if z > 0.0 {
                    let sum = &mut sums[v / RAYS * width + u / RAYS];
                    sum[0] += share / (z * z);
                    sum[1] += share / z;
                    sum[2] += share;
                }
            }
        }
        Self { width, height, sums }
    }

    /// Blurs by a normal distribution \[px\], along rows and then along columns.
    fn blurred(&self, sd: f64) -> Self {
        let reach = (BLUR_END * sd).ceil().max(1.0) as usize;
        let mut weights: Vec<f64> =
            (0..=reach).map(|k| math::exp(-0.5 * (k as f64 / sd) * (k as f64 / sd))).collect();
        let total: f64 = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
        weights.iter_mut().for_each(|w| *w /= total);
        let Self { width, height, sums } = self;
        let (width, height) = (*width, *height);
        let mut rows = vec![[0.0; 3]; sums.len()];
        for (row, out) in sums.chunks_exact(width.max(1)).zip(rows.chunks_exact_mut(width.max(1))) {
            // Whole rows at once, which processors do fast: for each distance the pixels to the left, then those to the right.
            for (k, weight) in weights.iter().enumerate().filter(|(k, _)| *k < width) {
                add(&mut out[k..], *weight, &row[..width - k]);
                if k > 0 {
                    add(&mut out[..width - k], *weight, &row[k..]);
                }
            }
        }
        let mut sums = vec![[0.0; 3]; rows.len()];
        for (v, out) in sums.chunks_exact_mut(width.max(1)).enumerate() {
            let row = |v: usize| &rows[v * width..(v + 1) * width];
            for (k, weight) in weights.iter().enumerate() {
                if k <= v {
                    add(out, *weight, row(v - k));
                }
                if k > 0 && v + k < height {
                    add(out, *weight, row(v + k));
                }
            }
        }
        Self { width, height, sums }
    }
}

/// Adds numbers times a weight to others.
fn add(to: &mut [[f64; 3]], weight: f64, numbers: &[[f64; 3]]) {
    to.as_flattened_mut().iter_mut().zip(numbers.as_flattened()).for_each(|(sum, x)| *sum += weight * x);
}
