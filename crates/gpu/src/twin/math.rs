//! Elementary functions.

use nalgebra::Vector3;

/// Vector.
pub(crate) type Vec3 = Vector3<f32>;

/// Sine and cosine by polynomials after reduction by pi/2 in three parts (Cephes), to about one unit in the last place. The built-in functions of
/// graphics devices are less exact.
pub(crate) fn sin_cos(x: f32) -> [f32; 2] {
    let n = (x * std::f32::consts::FRAC_2_PI).round_ties_even();
    let r = (-n).mul_add(1.570_312_5, x);
    let r = (-n).mul_add(4.837_513e-4, r);
    let r = (-n).mul_add(7.549_79e-8, r);
    let z = r * r;
    let p = (-1.951_529_6e-4_f32).mul_add(z, 8.332_161e-3).mul_add(z, -1.666_665_5e-1);
    let sine = (p * z).mul_add(r, r);
    let p = 2.443_315_7e-5_f32.mul_add(z, -1.388_731_6e-3).mul_add(z, 4.166_664_6e-2);
    let cosine = (p * z).mul_add(z, (-0.5_f32).mul_add(z, 1.0));
    let quarter = n as i32;
    let [mut s, mut c] = if quarter & 1 != 0 { [cosine, sine] } else { [sine, cosine] };
    if quarter & 2 != 0 {
        s = -s;
    }
    if (quarter + 1) & 2 != 0 {
        c = -c;
    }
    [s, c]
}

/// ln 2 in two parts; the product of the first and a small whole number is exact (Cephes).
const LN_2: [f32; 2] = [355.0 / 512.0, -2.121_944_4e-4];
/// Tangents of 22.5 and 67.5 degrees: between them an angle is computed as a difference from 45 degrees, above them from 90 degrees.
const TANGENTS: [f32; 2] = [0.414_213_56, 2.414_213_6];

/// Keeps a quotient of zeros finite.
const TINY: f32 = 1e-30;

/// ln(1 + x) for -0.3 < x < 0.42 (Cephes), to about one unit in the last place.
pub(crate) fn ln_1p(x: f32) -> f32 {
    const P: [f32; 9] = [
        7.037_683_6e-2,
        -1.151_461e-1,
        1.167_699_9e-1,
        -1.242_014_1e-1,
        1.424_932_3e-1,
        -1.666_805_8e-1,
        2.000_071_5e-1,
        -2.499_999_4e-1,
        3.333_333e-1,
    ];
    let p = polynomial(&P, x);
    let z = x * x;
    x + (p * z).mul_add(x, -0.5 * z)
}

/// Natural logarithm of a positive, normal number. The built-in functions of graphics devices have larger errors near 1.
pub(crate) fn ln(x: f32) -> f32 {
    const MANTISSA: u32 = 0x007f_ffff;
    const HALF: u32 = 0x3f00_0000;
    let bits = x.to_bits();
    let mut power = (bits >> 23) as f32 - 126.0;
    let mut part = f32::from_bits(bits & MANTISSA | HALF);
    if part < std::f32::consts::FRAC_1_SQRT_2 {
        power -= 1.0;
        part += part;
    }
    power.mul_add(LN_2[0], ln_1p(part - 1.0) + power * LN_2[1])
}

/// e to the x, exactly 1 at 0 (Cephes).
pub(crate) fn e_to(x: f32) -> f32 {
    const P: [f32; 6] = [1.987_569_1e-4, 1.398_2e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5];
    let power = (x * std::f32::consts::LOG2_E).round_ties_even();
    let r = (-power).mul_add(LN_2[1], (-power).mul_add(LN_2[0], x));
    let p = polynomial(&P, r);
    ((p * r).mul_add(r, r) + 1.0) * f32::from_bits(((power as i32 + 127) as u32) << 23)
}

/// (atan(t) / t - 1) / t^2 by the square of t, up to that of the tangent of 22.5 degrees (Cephes).
fn angle_rest(z: f32) -> f32 {
    const P: [f32; 4] = [8.053_744_5e-2, -1.387_768_6e-1, 1.997_771_1e-1, -3.333_295e-1];
    polynomial(&P, z)
}

/// Angle of the point (x, y), y >= 0 (Cephes). A built-in function may err by 4096 units in the last place.
pub(crate) fn angle_of(y: f32, x: f32) -> f32 {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let a = x.abs();
    let (start, t) = if y > TANGENTS[1] * a {
        (FRAC_PI_2, -a / y)
    } else if y > TANGENTS[0] * a {
        (FRAC_PI_4, (y - a) / (y + a))
    } else {
        (0.0, y / a.max(TINY))
    };
    let z = t * t;
    let angle = start + (angle_rest(z) * z).mul_add(t, t);
    if x < 0.0 { PI - angle } else { angle }
}

/// Polynomial with coefficients from the highest power down.
fn polynomial(coefficients: &[f32], x: f32) -> f32 {
    coefficients[1..].iter().fold(coefficients[0], |sum, &c| sum.mul_add(x, c))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_geometry::math;

    /// Against f64, over the ranges that draws and angles have.
    #[test]
    fn functions_are_right_to_a_few_roundings() {
        const STEPS: u32 = 200_000;
        const FEW: f64 = 3.0 * f32::EPSILON as f64;
        for k in 0..=STEPS {
            let part = k as f32 / STEPS as f32;
            let x = 1e-7 + 2.0 * part;
            let (found, truth) = (f64::from(ln(x)), math::ln(f64::from(x)));
            assert!((found - truth).abs() <= FEW * truth.abs().max(1e-6), "ln {x}: {found}, {truth}");
            let x = 4.0 * (part - 0.5);
            let (found, truth) = (f64::from(e_to(x)), math::exp(f64::from(x)));
            assert!((found / truth - 1.0).abs() < FEW, "e to {x}: {found}, {truth}");
            let turn = std::f64::consts::PI * f64::from(part);
            let (sine, cosine) = math::sin_cos(turn);
            let (y, x) = (sine.abs() as f32, cosine as f32);
            let (found, truth) = (f64::from(angle_of(y, x)), math::atan2(f64::from(y), f64::from(x)));
            assert!((found - truth).abs() <= FEW * truth, "angle {turn}: {found}, {truth}");
        }
        assert_eq!((e_to(0.0), e_to(-0.0), ln(1.0)), (1.0, 1.0, 0.0));
    }
}
