//! Random fields over an image, correlated over the matching window.

use super::window::window_sums;
use orchard_geometry::{Image, math};
use orchard_spec::Stream;

/// A field of mean 0 and variance 1.
///
/// White noise, uniform over 256 values, is averaged over the window once or twice. One average of windows of w pixels
/// gives the correlation 1 - |k| / w along each axis at a lag of k pixels, two averages make it smooth. A sum of w^2 uniform
/// numbers is close to normal: its excess kurtosis is -1.2 / w^2, and it ends at sqrt(3) w standard deviations.
pub(super) struct Field {
    /// Sums of bytes over the window.
    sums: Image<i32>,
    scale: FieldScale,
}

/// Scale of a random field over an image: twice a sum of bytes, less `centre`, times `scale` has mean 0 and variance 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldScale {
    /// Twice the mean of a sum.
    pub centre: i32,
    /// One over the standard deviation of twice a sum.
    pub scale: f32,
}

impl FieldScale {
    /// Scale of a field of windows of 2 `radius` + 1 pixels, averaged once or twice.
    pub(super) fn new(radius: usize, averages: usize) -> Self {
        let w = 2 * radius + 1;
        let count = if averages == 2 { w * w * w * w } else { w * w };
        Self { centre: 255 * count as i32, scale: (1.0 / variance(w, averages).sqrt()) as f32 }
    }
}

/// Columns and rows of the bytes of which a field is averaged.
fn padded_size((width, height): (usize, usize), radius: usize, averages: usize) -> (usize, usize) {
    let margin = averages * radius;
    (width + 2 * margin, height + 2 * margin)
}

impl Field {
    /// Draws a field; `averages` is 1 or 2.
    pub fn draw(stream: &mut Stream, size: (usize, usize), radius: usize, averages: usize) -> Self {
        let (wide, high) = padded_size(size, radius, averages);
        let mut bytes = vec![0; wide * high];
        stream.fill(&mut bytes);
        let white = Image::from_pixels(wide, high, bytes).unwrap_or_else(|| Image::filled(0, 0, 0_u8));
        let mut sums = window_sums(&white, radius);
        if averages == 2 {
            sums = window_sums(&sums, radius);
        }
        Self { sums, scale: FieldScale::new(radius, averages) }
    }

    /// Skips the numbers of a field in its stream.
    pub fn skip(stream: &mut Stream, size: (usize, usize), radius: usize, averages: usize) {
        let (wide, high) = padded_size(size, radius, averages);
        stream.skip(wide * high);
    }

    /// Value at a pixel, by its row-major index.
    pub fn at(&self, i: usize) -> f32 {
        (2 * self.sums.pixels()[i] - self.scale.centre) as f32 * self.scale.scale
    }
}

/// Variance of twice the sums over windows of `w` pixels, from that of twice a byte, (256^2 - 1) / 3, and the sum
/// of the squared weights along an axis: w, or of weights 1, 2 .. w .. 2, 1.
fn variance(w: usize, averages: usize) -> f64 {
    let w = w as f64;
    let weights = if averages == 1 { w } else { w * (2.0 * w * w + 1.0) / 3.0 };
    (256.0 * 256.0 - 1.0) / 3.0 * weights * weights
}

/// Number of faults in the window about each pixel ([`each_fault`]). A pixel has no match if its window has a fault.
pub(super) fn refusals(stream: &mut Stream, size: (usize, usize), radius: usize, share: f64) -> Image<i32> {
    let (wide, high) = padded_size(size, radius, 1);
    let mut faults = Image::filled(wide, high, 0_u8);
    each_fault(stream, size, radius, share, |fault| faults.pixels_mut()[fault] = 1);
    window_sums(&faults, radius)
}

/// Draws the faults of an image with `radius` more pixels on every side, and calls `found` with the row-major index of each. Faults are
/// independent with probability p, so that the share of pixels without a match is `share`: 1 - (1 - p)^(w^2) = share.
pub(super) fn each_fault(
    stream: &mut Stream,
    size: (usize, usize),
    radius: usize,
    share: f64,
    mut found: impl FnMut(usize),
) {
    let (wide, high) = padded_size(size, radius, 1);
    let w = (2 * radius + 1) as f64;
    // Zero for shares too small to differ from 0.
    let log_sound = math::ln(1.0 - share) / (w * w);
    if log_sound < 0.0 {
        // Pixels from one fault to the next are geometrically distributed.
        let mut gap = || (math::ln(1.0 - stream.unit()) / log_sound) as usize;
        let mut at = gap();
        while at < wide * high {
            found(at);
            at = at.saturating_add(1).saturating_add(gap());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_spec::Purpose;

    const SIZE: (usize, usize) = (256, 192);

    /// Correlation along an axis at a lag, from the weights of the average.
    fn correlation(w: usize, averages: usize, lag: usize) -> f64 {
        let weights: Vec<f64> = match averages {
            1 => vec![1.0; w],
            _ => (1..=w).chain((1..w).rev()).map(|x| x as f64).collect(),
        };
        let product =
            |lag: usize| weights.iter().zip(weights.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
        product(lag) / product(0)
    }

    #[test]
    fn moments_and_correlation_are_those_of_the_averages() {
        const FIELDS: u32 = 40;
        let (width, height) = SIZE;
        for (radius, averages) in [(1, 1), (3, 1), (3, 2), (5, 2)] {
            let w = 2 * radius + 1;
            let rho = |k: i32| correlation(w, averages, k.unsigned_abs() as usize);
            let reach = (averages * w) as i32;
            // Sums over all lags: how many pixels count as one, in means and in mean squares.
            let alike: f64 = (-reach..=reach).map(rho).sum();
            let alike_squared: f64 = (-reach..=reach).map(|k| rho(k) * rho(k)).sum();
            let pixels = f64::from(FIELDS) * (width * height) as f64;
            let (se_mean, se_square) = (alike / pixels.sqrt(), alike_squared * (2.0 / pixels).sqrt());

            let lags = [0, 1, radius, w, 2 * w];
            let (mut mean, mut along, mut down) = (0.0, [0.0; 5], [0.0; 5]);
            for frame in 0..FIELDS {
                let mut stream = Stream::of_frame(20_250_704, 0, frame, Purpose::Test);
                let field = Field::draw(&mut stream, SIZE, radius, averages);
                let at = |u: usize, v: usize| f64::from(field.at(v * width + u));
                let pairs = |du: usize, dv: usize| {
                    let (n_u, n_v) = (width - du, height - dv);
                    let products = (0..n_v).flat_map(|v| (0..n_u).map(move |u| (u, v)));
                    products.map(|(u, v)| at(u, v) * at(u + du, v + dv)).sum::<f64>() / (n_u * n_v) as f64
                };
                mean += (0..width * height).map(|i| f64::from(field.at(i))).sum::<f64>()
                    / (width * height) as f64;
                for (k, &lag) in lags.iter().enumerate() {
                    along[k] += pairs(lag, 0);
                    down[k] += pairs(0, lag);
                }
            }
            let n = f64::from(FIELDS);
            assert!((mean / n).abs() < 5.0 * se_mean, "{radius} {averages}: mean {}", mean / n);
            for (k, &lag) in lags.iter().enumerate() {
                // A product of correlated values varies no more than a square; lags take a tenth of the pixels at most.
                let allowed = 5.0 * se_square * 1.06;
                for measured in [along[k] / n, down[k] / n] {
                    let expected = correlation(w, averages, lag);
                    assert!(
                        (measured - expected).abs() < allowed,
                        "{radius} {averages} {lag}: {measured} {expected}"
                    );
                }
            }
        }
        // The closed form that the docs state.
        assert!((0..7).all(|k| (correlation(7, 1, k) - (1.0 - k as f64 / 7.0)).abs() < 1e-15));
    }

    #[test]
    fn refused_pixels_have_their_share() {
        const IMAGES: u32 = 40;
        let radius = 3;
        let w2 = 49.0_f64;
        for share in [0.0, 1e-17, 0.001, 0.05, 0.5, 1.0] {
            let (mut refused, mut pixels) = (0, 0);
            for frame in 0..IMAGES {
                let mut stream = Stream::of_frame(20_250_705, 0, frame, Purpose::Test);
                let counts = refusals(&mut stream, SIZE, radius, share);
                refused += counts.pixels().iter().filter(|&&n| n > 0).count();
                pixels += counts.pixels().len();
            }
            let found = refused as f64 / pixels as f64;
            // Two pixels are alike only if their windows overlap: (2 w - 1)^2 < 4 w^2 neighbours at most count as one.
            let error = (share * (1.0 - share) * 4.0 * w2 / pixels as f64).sqrt();
            assert!((found - share).abs() <= 5.0 * error, "{share}: {found}");
        }
    }
}
