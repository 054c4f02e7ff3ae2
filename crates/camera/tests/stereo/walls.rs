//! Flat walls: noise, its correlation, bias, quantisation, the left band, the limits of the range.

use crate::{Camera, NO_DROPOUT};
use orchard_geometry::DepthImage;

/// Images of a wall that each figure is taken from.
const IMAGES: u32 = 4;

/// Sums over measured disparities, as offsets from the true one \[px\].
struct Moments {
    n: f64,
    mean: f64,
    variance: f64,
    /// Variance of the depth [m^2].
    depth_variance: f64,
    /// Covariance at a lag along rows and along columns.
    covariance: Vec<[f64; 2]>,
}

/// Moments over the pixels that a wall at `z` leaves valid, with covariances at some lags.
fn moments(camera: &Camera, z: f64, lags: &[usize]) -> Moments {
    let scene = camera.whole_wall(z);
    let images: Vec<DepthImage> = (0..IMAGES).map(|frame| camera.take(&scene, frame).measured).collect();
    let offset = |depth: f32| camera.focal_baseline / f64::from(depth) - camera.disparity(z);
    let (mut n, mut sum, mut sum2, mut depth, mut depth2) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for &measured in images.iter().flat_map(|image| image.pixels()).filter(|&&z| z > 0.0) {
        let (d, dz) = (offset(measured), f64::from(measured) - z);
        n += 1.0;
        sum += d;
        sum2 += d * d;
        depth += dz;
        depth2 += dz * dz;
    }
    let covariance = |lag: usize| {
        [(lag, 0), (0, lag)].map(|(du, dv)| {
            let (mut n, mut sum) = (0.0, 0.0);
            for image in &images {
                for v in 0..image.height() - dv {
                    for u in 0..image.width() - du {
                        let (a, b) = (image[(u, v)], image[(u + du, v + dv)]);
                        if a > 0.0 && b > 0.0 {
                            n += 1.0;
                            sum += offset(a) * offset(b);
                        }
                    }
                }
            }
            sum / n
        })
    };
    let mean = sum / n;
    Moments {
        n,
        mean,
        variance: sum2 / n - mean * mean,
        depth_variance: depth2 / n - (depth / n) * (depth / n),
        covariance: lags.iter().map(|&lag| covariance(lag)).collect(),
    }
}

/// Noise of a window of w pixels is correlated as 1 - |k| / w along each axis. The mean of n pixels so varies as that of n
/// over the sum of the correlations, w^2; their mean square as that of n over the sum of the squared correlations.
fn pixels_that_count_as_one(w: usize) -> (f64, f64) {
    let w = w as f64;
    let squares = (2.0 * w * w + 1.0) / (3.0 * w);
    (w * w, squares * squares)
}

#[test]
fn noise_follows_the_law() {
    for (sunlight, s) in [(0.0, 0.05), (0.6, 0.08), (1.0, 0.10)] {
        let camera = Camera::new(&[("sunlight", sunlight, "1")]);
        assert!((camera.spec.disparity_sd() - s).abs() < 1e-12);
        let w = camera.window();
        let step = camera.spec.disparity_step.si();
        // Rounding adds its own variance: independent of the noise, as that is wider than a step.
        let variance = s * s + step * step / 12.0;
        let (alike, alike_squared) = pixels_that_count_as_one(w);
        for z in [0.4, 0.75, 1.0, 1.6, 2.4] {
            let lags = [1, 3, w - 1, w, 2 * w];
            let found = moments(&camera, z, &lags);
            // Five standard errors; the variance of a variance is 2 variance^2 over the count.
            let mean_error = 5.0 * (variance * alike / found.n).sqrt();
            let variance_error = 5.0 * variance * (2.0 * alike_squared / found.n).sqrt();
            assert!(found.mean.abs() < mean_error, "{s} {z}: bias {} px", found.mean);
            let off = (found.variance - variance).abs();
            assert!(off < variance_error, "{s} {z}: {} {variance}", found.variance);

            // sigma_z = z^2 sigma_d / (f B), times 1 + 8 (sigma_d / d)^2 to the next order.
            let sigma_z = z * z * variance.sqrt() / camera.focal_baseline;
            let curvature = 8.0 * variance / (camera.disparity(z) * camera.disparity(z));
            let allowed = variance_error / variance + curvature;
            let ratio = found.depth_variance / (sigma_z * sigma_z);
            assert!((ratio - 1.0).abs() < allowed, "{s} {z}: {ratio} of the law");

            for (&lag, covariances) in lags.iter().zip(&found.covariance) {
                let expected = s * s * (1.0 - lag as f64 / w as f64).max(0.0);
                for &covariance in covariances {
                    // A product varies no more than a square.
                    let off = (covariance - expected).abs();
                    assert!(off < variance_error, "{s} {z} lag {lag}: {covariance} {expected}");
                }
            }
        }
    }
}

/// At 1 m and 0.08 px: the figure that the sensor's documents give.
#[test]
fn a_metre_away_the_error_is_between_three_and_five_millimetres() {
    let camera = Camera::new(&[]);
    let sigma = moments(&camera, 1.0, &[]).depth_variance.sqrt();
    assert!((0.003..0.005).contains(&sigma), "{sigma}");
    let sigma = moments(&camera, 2.0, &[]).depth_variance.sqrt();
    assert!((0.012..0.019).contains(&sigma), "{sigma}");
}

/// The noise span with both ends at `sd` \[px\].
fn with_noise(sd: f64, step: f64) -> Camera {
    Camera::from_toml(&format!(
        "[d435i]\ndisparity_noise = {{ low = {sd}, high = {sd}, range = [0, 1], unit = 'px', source = 'x' }}\n\
         disparity_step = {{ value = {step}, range = [0, 1], unit = 'px', source = 'x' }}"
    ))
}

#[test]
fn disparities_are_whole_steps() {
    for (sd, step) in [(0.08, 0.031_25), (0.08, 0.25), (0.0, 0.031_25), (0.0, 0.3)] {
        let camera = with_noise(sd, step);
        for z in [0.5, 1.0, 2.2] {
            let measured = camera.take(&camera.whole_wall(z), 0).measured;
            for &depth in measured.pixels().iter().filter(|&&z| z > 0.0) {
                let d = camera.focal_baseline / f64::from(depth);
                // Four roundings to f32: step, f B, step times count, quotient.
                let rounding = 4.0 * f64::from(f32::EPSILON) * d;
                assert!((d - (d / step).round() * step).abs() < rounding, "{sd} {step} {z}: {d}");
                if sd == 0.0 {
                    assert!((d - camera.disparity(z)).abs() <= 0.5 * step + rounding);
                }
            }
        }
    }
}

#[test]
fn the_band_at_the_left_is_as_wide_as_the_disparity() {
    let camera = Camera::new(&[NO_DROPOUT]);
    for z in [0.35, 0.5, 0.8, 1.0, 1.7, 2.5] {
        let measured = camera.take(&camera.whole_wall(z), 0).measured;
        let d = camera.disparity(z);
        for v in 0..measured.height() {
            for u in 0..measured.width() {
                assert_eq!(measured[(u, v)] > 0.0, u as f64 >= d, "{z} m, pixel ({u}, {v}), {d} px");
            }
        }
    }
    // The figure that the project's sources give: 22 px at 1 m.
    assert_eq!(camera.disparity(1.0).floor(), 22.0);
}

#[test]
fn nothing_is_measured_out_of_range() {
    let camera = Camera::new(&[]);
    // Ten standard deviations from the limits.
    for z in [0.29, 3.5] {
        let image = camera.take(&camera.whole_wall(z), 0);
        assert!(image.measured.pixels().iter().chain(image.truth.depth.pixels()).all(|&z| z == 0.0));
    }
    // At the limit noise decides: half of the pixels, by the disparity's symmetry and up to one step of it.
    let (near, far) = camera.spec.range.si();
    let measured = camera.take(&camera.whole_wall(far), 0).measured;
    let (mut valid, mut n) = (0.0, 0.0);
    for v in 0..measured.height() {
        for u in camera.disparity(far).ceil() as usize..measured.width() {
            valid += f64::from(u8::from(measured[(u, v)] > 0.0));
            n += 1.0;
        }
    }
    let (s, step) = (camera.spec.disparity_sd(), camera.spec.disparity_step.si());
    let (alike, _) = pixels_that_count_as_one(camera.window());
    let expected = 0.5 * (1.0 - camera.spec.dropout_share());
    // The density of a normal deviate is 0.4 / s at most.
    let allowed = 0.4 / s * step + 5.0 * (0.25 * 4.0 * alike / n).sqrt();
    assert!((valid / n - expected).abs() < allowed, "{}", valid / n);
    assert!(measured.pixels().iter().all(|&z| z == 0.0 || (near..=far).contains(&f64::from(z))));
}
