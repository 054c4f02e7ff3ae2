//! Deterministic mathematics: `libm` versions of functions whose last bit differs between platforms' own libraries.

use std::ops::{Add, Mul, Sub};

/// Largest angle of `sin_cos_small`, pi / 4.
pub const SMALL_ANGLE: f64 = std::f64::consts::FRAC_PI_4;

/// Sine and cosine.
#[inline]
pub fn sin_cos(x: f64) -> (f64, f64) {
    if x.abs() <= SMALL_ANGLE { sin_cos_small(x, |c| c) } else { libm::sincos(x) }
}

/// Sine and cosine of an angle within [`SMALL_ANGLE`], by the minimax polynomials of fdlibm (`k_sin.c`,
/// `k_cos.c`), to less than one unit in the last place. It uses sums and products only, so that it works on
/// vectors: `T` is any type with the arithmetic of f64, and `constant` converts a number to it.
#[inline(always)]
pub fn sin_cos_small<T>(x: T, constant: impl Fn(f64) -> T) -> (T, T)
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T>,
{
    let c = constant;
    let x2 = x * x;
    let x4 = x2 * x2;
    let sine_tail = c(0.008_333_333_333_322_49)
        + x2 * (c(-0.000_198_412_698_298_579_5) + x2 * c(2.755_731_370_707_006_8e-6))
        + x2 * x4 * (c(-2.505_076_025_340_686_3e-8) + x2 * c(1.589_690_995_211_55e-10));
    let sine = x + x2 * x * (c(-0.166_666_666_666_666_32) + x2 * sine_tail);
    let cosine_tail = x2
        * (c(0.041_666_666_666_666_6)
            + x2 * (c(-0.001_388_888_888_887_411) + x2 * c(2.480_158_728_947_673e-5)))
        + x4 * x4
            * (c(-2.755_731_435_139_066_3e-7)
                + x2 * (c(2.087_572_321_298_175e-9) + x2 * c(-1.135_964_755_778_819_5e-11)));
    // 1 - x^2/2 rounds; the rounding error is added back with the tail.
    let (one, half) = (c(1.0), c(0.5) * x2);
    let head = one - half;
    let cosine = head + ((one - head - half) + x2 * cosine_tail);
    (sine, cosine)
}

macro_rules! through_libm {
    ($($(#[$doc:meta])* $name:ident($($arg:ident),*) = $function:path;)*) => {
        $($(#[$doc])* pub fn $name($($arg: f64),*) -> f64 { $function($($arg),*) })*
    };
}

through_libm! {
    /// Sine.
    sin(x) = libm::sin;
    /// Cosine.
    cos(x) = libm::cos;
    /// Tangent.
    tan(x) = libm::tan;
    /// Arc sine.
    asin(x) = libm::asin;
    /// Arc cosine.
    acos(x) = libm::acos;
    /// Angle of the point (x, y).
    atan2(y, x) = libm::atan2;
    /// e to the x.
    exp(x) = libm::exp;
    /// Natural logarithm.
    ln(x) = libm::log;
    /// e to the x, less 1; exact for small x, too.
    expm1(x) = libm::expm1;
    /// Natural logarithm of 1 + x; exact for small x, too.
    ln_1p(x) = libm::log1p;
    /// Hyperbolic tangent.
    tanh(x) = libm::tanh;
    /// Error function.
    erf(x) = libm::erf;
    /// Complementary error function.
    erfc(x) = libm::erfc;
    /// x to the y.
    pow(x, y) = libm::pow;
    /// Length of (x, y).
    hypot(x, y) = libm::hypot;
}

/// Angle wrapped to (-pi, pi].
pub fn wrap_angle(angle: f64) -> f64 {
    let turns = ((angle - std::f64::consts::PI) / std::f64::consts::TAU).ceil();
    angle - turns * std::f64::consts::TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_angles_round_as_in_libm() {
        const STEPS: i32 = 100_000;
        for k in -STEPS..=STEPS {
            let x = SMALL_ANGLE * f64::from(k) / f64::from(STEPS);
            for x in [x, x * x * x, x * 1e-9] {
                assert_eq!(sin_cos_small(x, |c| c), libm::sincos(x), "{x:e}");
            }
        }
    }
}
