//! The elastica: a clamped, inextensible rod under a load at its tip that keeps its direction.

use orchard_geometry::math;
use std::f64::consts::FRAC_PI_2;

/// Steps along the rod; the error of the Runge-Kutta method is then below 1e-10 of the length.
const STEPS: usize = 1000;

/// Halvings of the interval of the tip's slope.
const HALVINGS: usize = 60;

/// Tip of a rod of length 1 along x under a load across it: (shortfall along x, deflection), both over the length.
///
/// The slope t(s) obeys `t'' = -p cos t`, `t(0) = 0`, `t'(1) = 0`, with `p = P L^2 / (E I)` from 0 to 10. It is integrated from the tip, where its
/// slope is bisected until the base is horizontal.
pub fn elastica_tip(p: f64) -> (f64, f64) {
    let (_, x, y) = shoot(p, tip_slope(p));
    (1.0 - x, y)
}

/// Slope at the tip \[rad\].
fn tip_slope(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        // A larger slope at the tip leaves a larger one at the base.
        if shoot(p, middle).0 < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Slope at the base, and the rod's extent along and across, for a slope at the tip; fourth-order Runge-Kutta from the tip.
fn shoot(p: f64, tip: f64) -> (f64, f64, f64) {
    let h = 1.0 / STEPS as f64;
    let (mut t, mut bend, mut x, mut y) = (tip, 0.0, 0.0, 0.0);
    // u = 1 - s: t'' = -p cos t, and t falls from the tip to the base.
    let rate = |t: f64, bend: f64| {
        let (sin, cos) = math::sin_cos(t);
        [bend, -p * cos, cos, sin]
    };
    for _ in 0..STEPS {
        let k1 = rate(t, bend);
        let k2 = rate(t + 0.5 * h * k1[0], bend + 0.5 * h * k1[1]);
        let k3 = rate(t + 0.5 * h * k2[0], bend + 0.5 * h * k2[1]);
        let k4 = rate(t + h * k3[0], bend + h * k3[1]);
        let mean = |i: usize| h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        t += mean(0);
        bend += mean(1);
        x += mean(2);
        y += mean(3);
    }
    (t, x, y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small loads: w = p / 3, and the shortfall is of second order, p^2 / 15 (the integral of half the squared slope).
    #[test]
    fn a_small_load_bends_as_a_beam() {
        let p = 1e-3;
        let (shortfall, deflection) = elastica_tip(p);
        assert!((deflection / (p / 3.0) - 1.0).abs() < 1e-6, "{deflection}");
        assert!((shortfall / (p * p / 15.0) - 1.0).abs() < 1e-5, "{shortfall}");
    }

    /// The first integral of the rod, t'(0)^2 / 2 = p sin t(1), with the moment at the base t'(0) = p (1 - shortfall).
    #[test]
    fn the_moment_at_the_base_closes() {
        for p in [0.5, 1.0, 3.0, 10.0] {
            let arm = 1.0 - elastica_tip(p).0;
            assert!((p * arm * arm / (2.0 * math::sin(tip_slope(p))) - 1.0).abs() < 1e-8, "{p}");
        }
    }
}
