//! A smooth monotone function of one variable, by cubics between equally spaced points.

/// Cubic Hermite interpolation; beyond the ends it goes on straight.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Place of the first point.
    pub start: f64,
    /// Distance between points.
    pub step: f64,
    /// Value and slope at each point; at least two points.
    pub points: Vec<[f64; 2]>,
}

impl Curve {
    /// Number of intervals of a finger's opening: an arc of 1 rad with a lever of 0.1 m is then met to 1e-9 m.
    pub const INTERVALS: u32 = 64;

    /// Makes the curve through `intervals + 1` points over a range; `of` gives value and slope.
    pub(super) fn through([low, high]: [f64; 2], intervals: u32, of: impl Fn(f64) -> [f64; 2]) -> Self {
        let step = (high - low) / f64::from(intervals);
        let points = (0..=intervals).map(|k| of(low + step * f64::from(k))).collect();
        Self { start: low, step, points }
    }

    /// The interval about x with its ends, and the place in it in units of the step: below 0 or above 1 beyond the ends of the curve.
    fn interval(&self, x: f64) -> ([[f64; 2]; 2], f64) {
        let place = (x - self.start) / self.step;
        let last = self.points.len() - 2;
        // A place that is not a number is taken for the first interval.
        let k = (place.max(0.0) as usize).min(last);
        ([self.points[k], self.points[k + 1]], place - k as f64)
    }

    /// Value at a place.
    pub fn at(&self, x: f64) -> f64 {
        let ([[a, da], [b, db]], u) = self.interval(x);
        if u < 0.0 {
            return a + da * (u * self.step);
        }
        if u > 1.0 {
            return b + db * ((u - 1.0) * self.step);
        }
        let (da, db) = (da * self.step, db * self.step);
        let w = 1.0 - u;
        w * w * ((1.0 + 2.0 * u) * a + u * da) + u * u * ((1.0 + 2.0 * w) * b - w * db)
    }

    /// Slope at a place.
    pub fn slope(&self, x: f64) -> f64 {
        let ([[a, da], [b, db]], u) = self.interval(x);
        if u < 0.0 {
            return da;
        }
        if u > 1.0 {
            return db;
        }
        let w = 1.0 - u;
        6.0 * u * w * (b - a) / self.step + w * (1.0 - 3.0 * u) * da + u * (1.0 - 3.0 * w) * db
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_geometry::math::{cos, sin};

    /// An arc is met to a millionth, its slope to a hundred-thousandth; ends and straight continuation are exact.
    #[test]
    fn an_arc_is_followed() {
        let curve = Curve::through([0.2, 1.7], 32, |x| [cos(x), -sin(x)]);
        for k in 0..=1500 {
            let x = 0.2 + f64::from(k) * 1e-3;
            assert!((curve.at(x) - cos(x)).abs() < 1e-7, "{x}");
            assert!((curve.slope(x) + sin(x)).abs() < 1e-5, "{x}");
        }
        assert!((curve.at(0.1) - (cos(0.2) + 0.1 * sin(0.2))).abs() < 1e-12);
        assert!((curve.at(1.9) - (cos(1.7) - 0.2 * sin(1.7))).abs() < 1e-12);
        assert!(curve.at(f64::NAN).is_nan());
    }
}
