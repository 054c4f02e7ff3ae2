//! Vectors and angles.

use nalgebra::Vector3;

/// A vector.
pub(crate) type Vec3 = Vector3<f32>;

/// Sine and cosine by polynomials after reduction by pi/2 in three parts (Cephes), right to about one unit in the last place: the built-in ones of
/// a graphics device are not.
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

/// A symmetric matrix times a vector: columns from the diagonal down.
pub(crate) fn symmetric(a: Vec3, b: Vec3, v: Vec3) -> Vec3 {
    Vec3::new(a.dot(&v), Vec3::new(a.y, b.x, b.y).dot(&v), Vec3::new(a.z, b.y, b.z).dot(&v))
}

/// Whether a number, and its square, is finite. By bits: a device may leave comparisons with what is no number undefined.
pub(crate) fn is_finite(x: f32) -> bool {
    const EXPONENT: u32 = 0x7f80_0000;
    (x * x).to_bits() & EXPONENT != EXPONENT
}
