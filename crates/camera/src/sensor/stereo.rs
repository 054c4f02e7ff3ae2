//! Measurement of a stereo camera from a true depth image, step by step.
//!
//! Equations, figures and limits: `docs/computation/sensor.md`.

use super::ImageKey;
use super::noise::{Field, FieldScale, each_fault, refusals};
use super::window::{padded, window_sums, within};
use orchard_geometry::{DepthImage, Image};
use orchard_spec::camera::StereoSpec;
use orchard_spec::{Purpose, Stream};

/// Errors of a stereo camera as its arithmetic takes them, for kernels that add them elsewhere ([`Sensor::stereo`](super::Sensor::stereo)).
/// Figures are of the depth imager, in single precision where the arithmetic is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StereoErrors {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Focal length times the distance between the imagers \[px m\].
    pub focal_baseline: f32,
    /// Pixels by which the matching window extends to each side.
    pub window_radius: usize,
    /// Difference of disparity above which two pixels belong to different surfaces \[px\].
    pub surface_step: f32,
    /// Standard deviation of the disparity \[px\].
    pub disparity_sd: f32,
    /// Smallest step of the disparity \[px\].
    pub disparity_step: f32,
    /// Standard deviation of an edge's displacement \[px\].
    pub edge_shift: f32,
    /// Least share of a window that must show surfaces visible to both imagers.
    pub least_support: f32,
    /// Pixels to each side over which a step of disparity becomes a ramp.
    pub edge_ramp: usize,
    /// Largest standard deviation of the disparities that mix in a valid pixel \[px\].
    pub edge_limit: f32,
    /// Least and largest measured depth \[m\].
    pub range: (f32, f32),
    /// Share of pixels without a match.
    pub dropout_share: f64,
    /// Scale of the field of noise, averaged once.
    pub noise: FieldScale,
    /// Scale of the fields of displacements, averaged twice.
    pub shifts: FieldScale,
}

impl StereoErrors {
    /// Numbers of averages of the random fields of an image, in the order in which they are drawn: noise, and the displacements of edges along rows and along
    /// columns. Two averages make edges smooth.
    pub const AVERAGES: [usize; 3] = [1, 2, 2];

    /// Figures of a spec with an imager's width, height and horizontal focal length \[px\].
    pub(super) fn new(spec: &StereoSpec, (width, height): (usize, usize), focal: f64) -> Self {
        let window_radius = spec.window_radius.get() as usize;
        let (near, far) = spec.range.si();
        Self {
            width,
            height,
            focal_baseline: (focal * spec.baseline.si()) as f32,
            window_radius,
            surface_step: spec.surface_step.si() as f32,
            disparity_sd: spec.disparity_sd() as f32,
            disparity_step: spec.disparity_step.si() as f32,
            edge_shift: spec.edge_shift.si() as f32,
            least_support: spec.least_support.si() as f32,
            edge_ramp: spec.edge_ramp.get() as usize,
            edge_limit: spec.edge_limit.si() as f32,
            range: (near as f32, far as f32),
            dropout_share: spec.dropout_share(),
            noise: FieldScale::new(window_radius, 1),
            shifts: FieldScale::new(window_radius, 2),
        }
    }

    /// Faults of an image with `window_radius` more pixels on every side, by row-major index in ascending order: a pixel whose window has one has no match. They are
    /// what the processor draws behind the random fields.
    pub fn faults(&self, key: ImageKey) -> Vec<u32> {
        let (mut stream, size) = (stream_of(key), (self.width, self.height));
        for averages in Self::AVERAGES {
            Field::skip(&mut stream, size, self.window_radius, averages);
        }
        let mut faults = Vec::new();
        each_fault(&mut stream, size, self.window_radius, self.dropout_share, |fault| {
            faults.push(fault as u32)
        });
        faults
    }
}

fn stream_of(key: ImageKey) -> Stream {
    Stream::of_frame(key.seed, key.world, key.frame, Purpose::SensorNoise)
}

/// Returns the measured depth \[m\], 0 without a measurement. `truth` is the true depth at any range, 0 where there is no surface.
pub(super) fn measure(errors: &StereoErrors, truth: &DepthImage, key: ImageKey) -> DepthImage {
    let (width, height) = (truth.width(), truth.height());
    let (size, radius) = ((width, height), errors.window_radius);
    let mut stream = stream_of(key);
    let [noise, shift_u, shift_v] =
        StereoErrors::AVERAGES.map(|averages| Field::draw(&mut stream, size, radius, averages));
    let refused = refusals(&mut stream, size, radius, errors.dropout_share);

    let StereoErrors { focal_baseline, surface_step, .. } = *errors;
    let disparity = disparities(truth, focal_baseline);
    let matched = in_both_views(&disparity, surface_step);
    let support = window_sums(&padded(&matched, radius), radius);

    let (sd, shift) = (errors.disparity_sd, errors.edge_shift);
    let (step, least) = (errors.disparity_step, errors.least_support);
    let (near, far) = errors.range;
    let (d_true, matched, support) = (disparity.pixels(), matched.pixels(), support.pixels());
    let mut taken = Image::filled(width, height, 0.0_f32);
    for (v, row) in taken.pixels_mut().chunks_exact_mut(width.max(1)).enumerate() {
        let window_rows = within(v, height, radius);
        for (u, taken) in row.iter_mut().enumerate() {
            let i = v * width + u;
            let in_window = window_rows * within(u, width, radius);
            if (support[i] as f32) < least * in_window as f32 {
                continue;
            }
            // At an edge the window takes the side of a nearby pixel.
            let there =
                moved(v, shift * shift_v.at(i), height) * width + moved(u, shift * shift_u.at(i), width);
            let from = if (d_true[there] - d_true[i]).abs() > surface_step { there } else { i };
            let d = d_true[from];
            if matched[from] > 0 && refused.pixels()[there] == 0 && (u as f32) >= d {
                *taken = d;
            }
        }
    }
    let ramped = ramped(taken, errors.edge_ramp, errors.edge_limit);
    let mut measured = Image::filled(width, height, 0.0_f32);
    for (i, (z, &d)) in measured.pixels_mut().iter_mut().zip(ramped.pixels()).enumerate() {
        if d > 0.0 {
            let steps = ((d + sd * noise.at(i)) / step + 0.5) as i32;
            let depth = focal_baseline / (steps as f32 * step);
            if steps > 0 && depth >= near && depth <= far {
                *z = depth;
            }
        }
    }
    measured
}

/// Replaces each disparity by the mean of those within `radius` pixels along rows and columns: steps become ramps. Pixels without a match
/// have disparity 0, keep it, and count in no mean. A pixel whose window mixes disparities with a standard deviation above `limit` \[px\]
/// has no match.
fn ramped(disparity: Image<f32>, radius: usize, limit: f32) -> Image<f32> {
    if radius == 0 {
        return disparity;
    }
    let width = disparity.width();
    // Number, sum and sum of squares.
    let of = |&d: &f32| if d > 0.0 { [1.0, d, d * d] } else { [0.0; 3] };
    let own: Vec<[f32; 3]> = disparity.pixels().iter().map(of).collect();
    let sums = sums_of_columns(&sums_of_rows(&own, width, radius), width, radius);
    let mut out = disparity;
    for (d, [n, sum, squares]) in out.pixels_mut().iter_mut().zip(sums) {
        if *d > 0.0 {
            let mean = sum / n;
            let variance = (squares / n - mean * mean).max(0.0);
            *d = if variance <= limit * limit { mean } else { 0.0 };
        }
    }
    out
}

/// Sums over the pixels within `radius` of each along its row, from left to right.
fn sums_of_rows(from: &[[f32; 3]], width: usize, radius: usize) -> Vec<[f32; 3]> {
    let mut out = vec![[0.0; 3]; from.len()];
    for (row, out) in from.chunks_exact(width.max(1)).zip(out.chunks_exact_mut(width.max(1))) {
        // Whole rows at once, which processors do fast.
        for left in (1..=radius).rev().filter(|left| *left < width) {
            add(&mut out[left..], &row[..width - left]);
        }
        for right in (0..=radius).filter(|right| *right < width) {
            add(&mut out[..width - right], &row[right..]);
        }
    }
    out
}

/// Sums over the pixels within `radius` of each along its column, from above.
fn sums_of_columns(from: &[[f32; 3]], width: usize, radius: usize) -> Vec<[f32; 3]> {
    let mut out = vec![[0.0; 3]; from.len()];
    let rows: Vec<&[[f32; 3]]> = from.chunks_exact(width.max(1)).collect();
    for (v, out) in out.chunks_exact_mut(width.max(1)).enumerate() {
        for row in &rows[v.saturating_sub(radius)..rows.len().min(v + radius + 1)] {
            add(out, row);
        }
    }
    out
}

/// Adds numbers to others.
fn add(to: &mut [[f32; 3]], numbers: &[[f32; 3]]) {
    to.as_flattened_mut().iter_mut().zip(numbers.as_flattened()).for_each(|(sum, x)| *sum += x);
}

/// Disparity of each pixel \[px\], 0 where there is no surface.
fn disparities(depth: &DepthImage, focal_baseline: f32) -> Image<f32> {
    let mut disparity = depth.clone();
    for d in disparity.pixels_mut() {
        *d = if *d > 0.0 { focal_baseline / *d } else { 0.0 };
    }
    disparity
}

/// Returns 1 for each pixel whose surface the other imager sees too: column u - d lies within its picture and shows no
/// nearer surface.
fn in_both_views(disparity: &Image<f32>, surface_step: f32) -> Image<u8> {
    let width = disparity.width();
    let mut seen = Image::filled(width, disparity.height(), 0_u8);
    // Largest disparity in each column of the other picture.
    let mut nearest = vec![0.0_f32; width];
    let rows = disparity.pixels().chunks_exact(width.max(1));
    for (row, seen) in rows.zip(seen.pixels_mut().chunks_exact_mut(width.max(1))) {
        nearest.fill(0.0);
        let column = |u: usize, d: f32| {
            let there = u as f32 - d;
            // d > 0, so the column is that of the pixel at most.
            (d > 0.0 && there >= 0.0).then_some(((there + 0.5) as usize).min(u))
        };
        let mut last: Option<(usize, f32)> = None;
        for (u, &d) in row.iter().enumerate() {
            let there = column(u, d);
            if let Some(there) = there {
                nearest[there] = nearest[there].max(d);
                // Fill single gaps of a surface that is wider in the other imager's picture.
                if let Some((last, d_last)) = last
                    && there == last + 2
                    && (d - d_last).abs() <= surface_step
                {
                    nearest[last + 1] = nearest[last + 1].max(d.min(d_last));
                }
            }
            last = there.map(|there| (there, d));
        }
        for ((u, &d), seen) in row.iter().enumerate().zip(seen) {
            *seen = u8::from(column(u, d).is_some_and(|there| nearest[there] <= d + surface_step));
        }
    }
    seen
}

/// Index of the pixel `shift` away from pixel `at` along an axis, clamped to the image.
fn moved(at: usize, shift: f32, length: usize) -> usize {
    let moved = (at as f32 + shift + 0.5).max(0.0) as usize;
    moved.min(length - 1)
}
