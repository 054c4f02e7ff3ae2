//! Measurement of a time-of-flight camera from a true depth image, step by step.
//!
//! Equations, figures and limits: `docs/computation/sensor.md`.

use super::ImageKey;
use super::noise::{Field, FieldScale};
use orchard_geometry::{DepthImage, Image, math};
use orchard_spec::camera::TimeOfFlightSpec;
use orchard_spec::{Purpose, Stream};

const RAYS: usize = TimeOfFlightErrors::RAYS;
/// Number of standard deviations at which the blur ends.
const BLUR_END: f64 = 3.0;

/// Errors of a time-of-flight camera as its arithmetic takes them, for kernels that add them elsewhere
/// ([`Sensor::time_of_flight`](super::Sensor::time_of_flight)).
#[derive(Debug, Clone, PartialEq)]
pub struct TimeOfFlightErrors {
    /// Columns of the depth imager.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixels to each side over which noise is alike.
    pub noise_window: usize,
    /// Standard deviation of the depth of a bright surface \[m\].
    pub noise_floor: f64,
    /// Standard deviation of the depth at one metre \[m\] that falls with the returned light.
    pub noise_at_metre: f64,
    /// Light that a pixel needs on average \[1/m^2\].
    pub least_light: f64,
    /// Standard deviation of the light needed, as a share of it.
    pub reach_spread: f64,
    /// Largest standard deviation of the depths that mix in a valid pixel \[m\].
    pub mixing: f64,
    /// Weights of the blur along a row or column, from the pixel itself outwards on either side; they sum to 1 over both sides.
    pub blur: Vec<f64>,
    /// Least and largest measured depth \[m\].
    pub range: (f64, f64),
    /// Scale of the random fields of noise and of the light needed, drawn in this order and averaged once.
    pub noise: FieldScale,
}

impl TimeOfFlightErrors {
    /// Rays along each side of a pixel over which its light is summed.
    pub const RAYS: usize = 2;
    /// Random fields of an image.
    pub const FIELDS: usize = 2;

    /// Figures of a spec with an imager's columns and rows.
    pub(super) fn new(spec: &TimeOfFlightSpec, (width, height): (usize, usize)) -> Self {
        let noise_window = spec.noise_window.get() as usize;
        Self {
            width,
            height,
            noise_window,
            noise_floor: spec.noise_floor.si(),
            noise_at_metre: spec.noise_at_metre(),
            least_light: 1.0 / (spec.reach() * spec.reach()),
            reach_spread: spec.reach_spread.si(),
            mixing: spec.mixing.si(),
            blur: blur(spec.blur.si()),
            range: spec.range.si(),
            noise: FieldScale::new(noise_window, 1),
        }
    }
}

/// Weights of a normal distribution \[px\] from its middle outwards.
fn blur(sd: f64) -> Vec<f64> {
    let reach = (BLUR_END * sd).ceil().max(1.0) as usize;
    let mut weights: Vec<f64> =
        (0..=reach).map(|k| math::exp(-0.5 * (k as f64 / sd) * (k as f64 / sd))).collect();
    let total: f64 = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
    weights.iter_mut().for_each(|w| *w /= total);
    weights
}

/// Returns the measured depth \[m\], 0 without a measurement. `truth` is the true depth at any range, 0 where there is no surface, with
/// [`TimeOfFlightErrors::RAYS`] pixels for each pixel along each side.
pub(super) fn measure(errors: &TimeOfFlightErrors, truth: &DepthImage, key: ImageKey) -> DepthImage {
    let light = Light::of(truth).blurred(&errors.blur);
    let (width, height) = (light.width, light.height);
    let mut stream = Stream::of_frame(key.seed, key.world, key.frame, Purpose::SensorNoise);
    let window = errors.noise_window;
    let noise = Field::draw(&mut stream, (width, height), window, 1);
    let need = Field::draw(&mut stream, (width, height), window, 1);
    let (floor, at_metre) = (errors.noise_floor, errors.noise_at_metre);
    let (mixing, spread) = (errors.mixing, errors.reach_spread);
    let least = errors.least_light;
    let (near, far) = errors.range;
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

    /// Blurs by weights, along rows and then along columns.
    fn blurred(&self, weights: &[f64]) -> Self {
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
