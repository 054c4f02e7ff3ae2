//! A vector of f32, one entry a world, with operators; three of them make a vector in space.

use super::instructions::Instructions;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// One number of every world in a tile.
#[derive(Clone, Copy)]
pub(crate) struct Lane<S: Instructions> {
    simd: S,
    /// The register.
    pub value: S::Vector,
}

/// A vector in space of every world in a tile.
pub(crate) type Lane3<S> = [Lane<S>; 3];

macro_rules! binary {
    ($trait:ident, $method:ident) => {
        impl<S: Instructions> $trait for Lane<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self { simd: self.simd, value: self.simd.$method(self.value, other.value) }
            }
        }
    };
}
binary!(Add, add);
binary!(Sub, sub);
binary!(Mul, mul);
binary!(Div, div);

impl<S: Instructions> Neg for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { simd: self.simd, value: self.simd.neg(self.value) }
    }
}

impl<S: Instructions> Lane<S> {
    /// Repeats a number in every world.
    #[inline(always)]
    pub fn splat(simd: S, number: f32) -> Self {
        Self { simd, value: simd.splat(number) }
    }

    /// From memory.
    #[inline(always)]
    pub fn load(simd: S, value: S::Vector) -> Self {
        Self { simd, value }
    }

    /// From memory, for use with `self`.
    #[inline(always)]
    pub fn beside(self, value: S::Vector) -> Self {
        Self { simd: self.simd, value }
    }

    /// To memory.
    #[inline(always)]
    pub fn store(self, to: &mut S::Vector) -> Self {
        *to = self.value;
        self
    }

    /// `self * b + c`, with one rounding where the processor has such an instruction.
    #[inline(always)]
    pub fn mul_add(self, b: Self, c: Self) -> Self {
        Self { simd: self.simd, value: self.simd.mul_add(self.value, b.value, c.value) }
    }

    /// `c - self * b`, likewise.
    #[inline(always)]
    pub fn take_from(self, b: Self, c: Self) -> Self {
        Self { simd: self.simd, value: self.simd.take_from(self.value, b.value, c.value) }
    }

    /// `self` in the worlds where the bits of `mask` are set, elsewhere 0.
    #[inline(always)]
    pub fn only(self, mask: S::Vector) -> Self {
        let simd = self.simd;
        Self { simd, value: simd.vector(simd.and(simd.bits(mask), simd.bits(self.value))) }
    }

    /// `self` in some worlds, elsewhere `otherwise`.
    #[inline(always)]
    pub fn where_true(self, worlds: S::Worlds, otherwise: Self) -> Self {
        Self { simd: self.simd, value: self.simd.select(worlds, self.value, otherwise.value) }
    }

    /// The worlds in which `self` is above `limit`.
    #[inline(always)]
    fn above(self, limit: Self) -> S::Worlds {
        self.simd.above(self.value, limit.value)
    }

    /// True if `self` is above `limit` in any world.
    #[inline(always)]
    pub fn any_above(self, limit: Self) -> bool {
        self.simd.any(self.above(limit))
    }

    /// Absolute value.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self { simd: self.simd, value: self.simd.abs(self.value) }
    }

    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self { simd: self.simd, value: self.simd.sqrt(self.value) }
    }

    /// `then` in the worlds where `self > limit`, elsewhere `otherwise`.
    #[inline(always)]
    pub fn if_above(self, limit: Self, then: Self, otherwise: Self) -> Self {
        then.where_true(self.above(limit), otherwise)
    }

    /// Sine and cosine of angles within an eighth of a turn, by minimax polynomials.
    #[inline(always)]
    fn sin_cos_within_an_eighth(self) -> (Self, Self) {
        const SINE: [f32; 3] = [-1.951_529_6e-4, 8.332_161e-3, -1.666_665_5e-1];
        const COSINE: [f32; 3] = [2.443_315_7e-5, -1.388_731_6e-3, 4.166_664_6e-2];
        let constant = |number| Self::splat(self.simd, number);
        let z = self * self;
        let polynomial = |c: [f32; 3]| constant(c[0]).mul_add(z, constant(c[1])).mul_add(z, constant(c[2]));
        let sine = (polynomial(SINE) * z).mul_add(self, self);
        let cosine = (polynomial(COSINE) * z).mul_add(z, constant(0.5).take_from(z, constant(1.0)));
        (sine, cosine)
    }

    /// Sine and cosine to about 1 unit in the last place for angles up to some thousand radians: reduction
    /// by pi/2 in three parts, then minimax polynomials on [-pi/4, pi/4].
    #[inline(always)]
    pub fn sin_cos(self) -> (Self, Self) {
        /// 1.5 * 2^23: a sum with it is rounded to a whole number, which is in its low bits.
        const ROUNDING: f32 = 12_582_912.0;
        /// pi/2 in three parts; the first two have few enough bits that a multiple of them is exact.
        const HALF_PI: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];
        let simd = self.simd;
        let constant = |number| Self::splat(simd, number);
        let shifted = self.mul_add(constant(std::f32::consts::FRAC_2_PI), constant(ROUNDING));
        let quarter_turns = shifted - constant(ROUNDING);
        let r = quarter_turns.take_from(constant(HALF_PI[0]), self);
        let r = quarter_turns.take_from(constant(HALF_PI[1]), r);
        let r = quarter_turns.take_from(constant(HALF_PI[2]), r);
        let (sine, cosine) = r.sin_cos_within_an_eighth();

        // Quarter turns as bits: an odd number swaps the two, the second bit turns the sign.
        let bits = |lane: Self| simd.bits(lane.value);
        let lane = |bits| Self { simd, value: simd.vector(bits) };
        let count = bits(shifted);
        let (zero, one) = (simd.splat_bits(0), simd.splat_bits(1));
        let (two, sign) = (simd.splat_bits(2), simd.splat_bits(1 << 31));
        let is_odd = simd.sub_bits(zero, simd.and(count, one));
        let swap = simd.and(is_odd, simd.xor(bits(sine), bits(cosine)));
        // 0 - 2 has the sign bit, 0 - 0 has not.
        let sign_of = |count| simd.and(sign, simd.sub_bits(zero, simd.and(count, two)));
        let s = simd.xor(simd.xor(bits(sine), swap), sign_of(count));
        let c = simd.xor(simd.xor(bits(cosine), swap), sign_of(simd.add_bits(count, one)));
        (lane(s), lane(c))
    }
}

/// Sine and cosine of two angles. Most joints bend by less than an eighth of a turn; the reduction by no quarter turn at
/// all is exact, so that leaving it out changes no bit.
#[inline(always)]
pub(crate) fn sin_cos_pair<S: Instructions>(a: Lane<S>, b: Lane<S>) -> [(Lane<S>, Lane<S>); 2] {
    /// Just under pi/4.
    const EIGHTH: f32 = 0.785;
    let simd = a.simd;
    let size = |x: Lane<S>| simd.abs(x.value);
    let largest = Lane { simd, value: simd.max(size(a), size(b)) };
    if largest.any_above(Lane::splat(simd, EIGHTH)) {
        [a.sin_cos(), b.sin_cos()]
    } else {
        [a.sin_cos_within_an_eighth(), b.sin_cos_within_an_eighth()]
    }
}

/// Angle of the points (x, y), between -pi and pi, to about 2e-7: reduction to an eighth of a turn, then Cephes' polynomial.
#[inline(always)]
pub(crate) fn atan2<S: Instructions>(y: Lane<S>, x: Lane<S>) -> Lane<S> {
    const ATAN: [f32; 4] = [8.053_745e-2, -1.387_768_6e-1, 1.997_771_1e-1, -3.333_295e-1];
    /// Tangents of 22.5 and 67.5 degrees.
    const TAN_22: f32 = 0.414_213_57;
    const TAN_67: f32 = 2.414_213_7;
    /// Gives the origin the angle 0.
    const TINY: f32 = 1e-30;
    let constant = |number| Lane::splat(x.simd, number);
    let (zero, a, b) = (constant(0.0), x.abs(), y.abs());
    let (is_above, is_steep) = (b.above(constant(TAN_22) * a), b.above(constant(TAN_67) * a));
    let (mut upper, mut lower, mut start) = (b, a + constant(TINY), zero);
    // Most angles are small; where none is above, the selections would change no bit.
    if x.simd.any(is_above) {
        upper = (-a).where_true(is_steep, (b - a).where_true(is_above, upper));
        lower = b.where_true(is_steep, (b + a).where_true(is_above, lower));
        start = constant(std::f32::consts::FRAC_PI_2)
            .where_true(is_steep, constant(std::f32::consts::FRAC_PI_4).where_true(is_above, zero));
    }
    let t = upper / lower;
    let z = t * t;
    let p = constant(ATAN[0]).mul_add(z, constant(ATAN[1])).mul_add(z, constant(ATAN[2]));
    let angle = start + (p.mul_add(z, constant(ATAN[3])) * z).mul_add(t, t);
    let angle = zero.if_above(x, constant(std::f32::consts::PI) - angle, angle);
    zero.if_above(y, -angle, angle)
}

/// The worlds in which the bits of a mask are set.
#[inline(always)]
pub(crate) fn lanes_of<S: Instructions>(simd: S, mask: S::Vector) -> S::Worlds {
    simd.worlds(simd.bits(mask))
}

#[inline(always)]
pub(crate) fn load3<S: Instructions>(simd: S, from: &[S::Vector]) -> Lane3<S> {
    [Lane::load(simd, from[0]), Lane::load(simd, from[1]), Lane::load(simd, from[2])]
}

#[inline(always)]
pub(crate) fn store3<S: Instructions>(to: &mut [S::Vector], v: Lane3<S>) {
    for (to, v) in to.iter_mut().zip(v) {
        *to = v.value;
    }
}

#[inline(always)]
pub(crate) fn add<S: Instructions>(a: Lane3<S>, b: Lane3<S>) -> Lane3<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn sub<S: Instructions>(a: Lane3<S>, b: Lane3<S>) -> Lane3<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn scale<S: Instructions>(s: Lane<S>, v: Lane3<S>) -> Lane3<S> {
    [s * v[0], s * v[1], s * v[2]]
}

/// `s v + c`.
#[inline(always)]
pub(crate) fn axpy<S: Instructions>(s: Lane<S>, v: Lane3<S>, c: Lane3<S>) -> Lane3<S> {
    [s.mul_add(v[0], c[0]), s.mul_add(v[1], c[1]), s.mul_add(v[2], c[2])]
}

/// `c - s v`.
#[inline(always)]
pub(crate) fn axmy<S: Instructions>(s: Lane<S>, v: Lane3<S>, c: Lane3<S>) -> Lane3<S> {
    [s.take_from(v[0], c[0]), s.take_from(v[1], c[1]), s.take_from(v[2], c[2])]
}

#[inline(always)]
pub(crate) fn dot<S: Instructions>(a: Lane3<S>, b: Lane3<S>) -> Lane<S> {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// `a . b + c`.
#[inline(always)]
pub(crate) fn dot_add<S: Instructions>(a: Lane3<S>, b: Lane3<S>, c: Lane<S>) -> Lane<S> {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2].mul_add(b[2], c)))
}

#[inline(always)]
pub(crate) fn cross<S: Instructions>(a: Lane3<S>, b: Lane3<S>) -> Lane3<S> {
    [
        a[1].mul_add(b[2], -(a[2] * b[1])),
        a[2].mul_add(b[0], -(a[0] * b[2])),
        a[0].mul_add(b[1], -(a[1] * b[0])),
    ]
}

/// `a x b + c`.
#[inline(always)]
pub(crate) fn cross_add<S: Instructions>(a: Lane3<S>, b: Lane3<S>, c: Lane3<S>) -> Lane3<S> {
    [
        a[1].mul_add(b[2], a[2].take_from(b[1], c[0])),
        a[2].mul_add(b[0], a[0].take_from(b[2], c[1])),
        a[0].mul_add(b[1], a[1].take_from(b[0], c[2])),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Baseline;
    use orchard_geometry::math;

    #[test]
    fn angles_of_points() {
        let mut worst = 0.0_f64;
        for k in -2_000..=2_000 {
            let angle = f64::from(k) * std::f64::consts::PI / 2_000.0;
            for size in [1e-6, 1.0, 300.0] {
                let (s, c) = math::sin_cos(angle);
                let (y, x) = ((size * s) as f32, (size * c) as f32);
                let exact = math::atan2(f64::from(y), f64::from(x));
                for found in [
                    atan2(Lane::splat(pulp::Scalar, y), Lane::splat(pulp::Scalar, x)).value,
                    atan2(Lane::splat(Baseline, y), Lane::splat(Baseline, x)).value.to_array()[1],
                ] {
                    worst = worst.max((f64::from(found) - exact).abs());
                }
            }
        }
        // Two units in the last place of pi.
        assert!(worst < 5e-7, "{worst}");
        assert_eq!(atan2(Lane::splat(pulp::Scalar, 0.0), Lane::splat(pulp::Scalar, 0.0)).value, 0.0);
    }

    /// Fused and not.
    #[test]
    fn sine_and_cosine() {
        let mut worst = 0.0_f64;
        for k in -40_000..40_000 {
            let angle = k as f32 * 1.234e-3;
            let (s_exact, c_exact) = math::sin_cos(f64::from(angle));
            let mut hold = |s: f32, c: f32| {
                worst = worst.max((f64::from(s) - s_exact).abs()).max((f64::from(c) - c_exact).abs());
            };
            let (s, c) = Lane::splat(pulp::Scalar, angle).sin_cos();
            hold(s.value, c.value);
            let (s, c) = Lane::splat(Baseline, angle).sin_cos();
            hold(s.value.to_array()[3], c.value.to_array()[3]);
        }
        // One unit in the last place of a number near 1, and the reduction's rest at 50 rad.
        assert!(worst < 1.5e-7, "{worst}");
    }
}
