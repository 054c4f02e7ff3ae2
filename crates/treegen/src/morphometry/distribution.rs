//! Moments and quantiles of samples, and distances between distributions.

use orchard_geometry::math;

/// Mean and sample standard deviation; NaN for fewer than one and two values.
pub fn mean_and_sd(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, (squares / (n - 1.0)).sqrt())
}

/// Quantile by linear interpolation between order statistics (type 7 of Hyndman and Fan 1996); NaN of an empty sample.
pub fn quantile(values: &[f64], p: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = p.clamp(0.0, 1.0) * last as f64;
    let below = at.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (sorted[above] - sorted[below]) * (at - below as f64)
}

/// Middle value; NaN of an empty sample.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// Kolmogorov-Smirnov distance between a sample and a distribution function: the largest difference on either
/// side of every step.
pub fn ks_distance(values: &[f64], cdf: impl Fn(f64) -> f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let apart = |(i, &v): (usize, &f64)| {
        let f = cdf(v);
        (f - i as f64 / n).abs().max((f - (i as f64 + 1.0) / n).abs())
    };
    sorted.iter().enumerate().map(apart).fold(0.0, f64::max)
}

/// Kolmogorov-Smirnov distance that two samples of one distribution exceed with a chance of 5 %, for large samples
/// (Smirnov 1948, Ann. Math. Stat. 19:279-281): sqrt(-ln(0.05 / 2) / 2) sqrt((n + m) / (n m)).
pub fn ks_critical(n: usize, m: usize) -> f64 {
    let (n, m) = (n as f64, m as f64);
    (-0.5 * math::ln(0.025) * (n + m) / (n * m)).sqrt()
}

/// Distribution function that joins quantiles of a sample by straight lines: `quantiles[k]` is that of
/// probability k / (n - 1).
pub fn quantile_cdf(quantiles: &[f64], x: f64) -> f64 {
    let Some(last) = quantiles.len().checked_sub(1) else { return f64::NAN };
    let above = quantiles.partition_point(|&q| q <= x);
    if above == 0 {
        return 0.0;
    }
    if above > last {
        return 1.0;
    }
    let (low, high) = (quantiles[above - 1], quantiles[above]);
    (above as f64 - 1.0 + (x - low) / (high - low)) / last as f64
}

/// Distribution function of the normal distribution, by the complementary error function.
pub fn normal_cdf(x: f64, mean: f64, sd: f64) -> f64 {
    0.5 * math::erfc((mean - x) / (sd * std::f64::consts::SQRT_2))
}

/// Mode on [low, high]: the maximum of a Gaussian kernel density of a bandwidth, reflected at both
/// ends, on a grid of a thousand steps. NaN of an empty sample.
pub fn mode(values: &[f64], (low, high): (f64, f64), bandwidth: f64) -> f64 {
    const STEPS: usize = 1000;
    let step = (high - low) / STEPS as f64;
    if values.is_empty() {
        return f64::NAN;
    }
    // Binned first: a kernel over bins of a thousandth of the range.
    let mut bins = [0.0_f64; STEPS + 1];
    for value in values.iter().filter(|v| (low..=high).contains(v)) {
        bins[((value - low) / step).round() as usize] += 1.0;
    }
    let density = |at: usize| -> f64 {
        let x = at as f64 * step;
        let kernel = |distance: f64| math::exp(-0.5 * distance * distance / (bandwidth * bandwidth));
        let whole = high - low;
        let term = |(i, &weight): (usize, &f64)| {
            if weight == 0.0 {
                return 0.0;
            }
            let v = i as f64 * step;
            weight * (kernel(x - v) + kernel(x + v) + kernel(2.0 * whole - x - v))
        };
        bins.iter().enumerate().map(term).sum()
    };
    let best = (0..=STEPS).map(|at| (at, density(at))).max_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(f64::NAN, |(at, _)| low + at as f64 * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_and_quantiles_of_a_few_numbers() {
        let values = [4.0, 1.0, 3.0, 2.0];
        let (mean, sd) = mean_and_sd(&values);
        assert!((mean - 2.5).abs() < 1e-15 && (sd - (5.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!([0.0, 0.25, 0.5, 1.0].map(|p| quantile(&values, p)), [1.0, 1.75, 2.5, 4.0]);
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn distance_to_the_uniform_distribution() {
        // The middles of n equal parts are 1 / 2n away from the line; all at 0.2 are 0.8.
        let middles: Vec<f64> = (0..10).map(|k| (f64::from(k) + 0.5) / 10.0).collect();
        let uniform = |x: f64| x.clamp(0.0, 1.0);
        assert!((ks_distance(&middles, uniform) - 0.05).abs() < 1e-12);
        assert!((ks_distance(&[0.2; 5], uniform) - 0.8).abs() < 1e-15);
    }

    #[test]
    fn the_critical_distance_has_its_tabulated_factor() {
        // 1.358 at 5 %, of two samples of 50: times sqrt(2 / 50).
        assert!((ks_critical(50, 50) - 1.358 * 0.2).abs() < 1e-4);
    }

    #[test]
    fn quantiles_make_a_distribution_function() {
        let at = |x| quantile_cdf(&[0.0, 1.0, 1.0, 3.0], x);
        assert_eq!([-1.0, 0.0, 0.5, 2.0, 3.0, 9.0].map(at), [0.0, 0.0, 1.0 / 6.0, 2.5 / 3.0, 1.0, 1.0]);
        // A step where two quantiles coincide: the value from the right.
        assert_eq!(at(1.0), 2.0 / 3.0);
    }

    #[test]
    fn normal_cdf_has_its_tabulated_values() {
        assert_eq!(normal_cdf(3.0, 3.0, 2.0), 0.5);
        // Abramowitz and Stegun, table 26.1.
        assert!((normal_cdf(5.0, 3.0, 2.0) - 0.841_344_746_068_543).abs() < 1e-12);
        assert!((normal_cdf(-1.0, 3.0, 2.0) - 0.022_750_131_948_179).abs() < 1e-12);
    }

    #[test]
    fn the_mode_is_where_the_values_are_densest() {
        let values: Vec<f64> = (0..=100).map(f64::from).chain([60.0; 30]).collect();
        assert!((mode(&values, (0.0, 180.0), 5.0) - 60.0).abs() < 1.0);
        assert!(mode(&[0.0; 9], (0.0, 180.0), 5.0).abs() < 1e-12);
    }
}
