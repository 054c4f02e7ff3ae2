//! A vector of f32, one entry a world, with operators; three of them make a vector in space.

use pulp::Simd;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// One number of every world in a tile.
#[derive(Clone, Copy)]
pub(crate) struct Lane<S: Simd> {
    simd: S,
    /// The register.
    pub value: S::f32s,
}

/// A vector in space of every world in a tile.
pub(crate) type Lane3<S> = [Lane<S>; 3];

macro_rules! binary {
    ($trait:ident, $name:ident, $method:ident) => {
        impl<S: Simd> $trait for Lane<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self { simd: self.simd, value: self.simd.$method(self.value, other.value) }
            }
        }
    };
}
binary!(Add, add, add_f32s);
binary!(Sub, sub, sub_f32s);
binary!(Mul, mul, mul_f32s);
binary!(Div, div, div_f32s);

impl<S: Simd> Neg for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { simd: self.simd, value: self.simd.neg_f32s(self.value) }
    }
}

impl<S: Simd> Lane<S> {
    /// The same number in every world.
    #[inline(always)]
    pub fn splat(simd: S, number: f32) -> Self {
        Self { simd, value: simd.splat_f32s(number) }
    }

    /// From memory.
    #[inline(always)]
    pub fn load(simd: S, value: S::f32s) -> Self {
        Self { simd, value }
    }

    /// From memory, for use with `self`.
    #[inline(always)]
    pub fn beside(self, value: S::f32s) -> Self {
        Self { simd: self.simd, value }
    }

    /// Whether a product and sum are rounded once. Not on SSE and on the portable path, where pulp would go
    /// through a library call for each lane.
    const IS_FUSED: bool = S::F32_LANES > 4 || (cfg!(target_arch = "aarch64") && S::F32_LANES > 1);

    /// `self * b + c`, with one rounding where the processor has such an instruction.
    #[inline(always)]
    pub fn mul_add(self, b: Self, c: Self) -> Self {
        if !Self::IS_FUSED {
            return self * b + c;
        }
        Self { simd: self.simd, value: self.simd.mul_add_e_f32s(self.value, b.value, c.value) }
    }

    /// `c - self * b`, likewise.
    #[inline(always)]
    pub fn take_from(self, b: Self, c: Self) -> Self {
        if !Self::IS_FUSED {
            return c - self * b;
        }
        Self { simd: self.simd, value: self.simd.negate_mul_add_e_f32s(self.value, b.value, c.value) }
    }

    /// `self` in the worlds where the bits of `mask` are set, elsewhere 0.
    #[inline(always)]
    pub fn only(self, mask: S::f32s) -> Self {
        let simd = self.simd;
        let bits = simd.and_u32s(simd.transmute_u32s_f32s(mask), simd.transmute_u32s_f32s(self.value));
        Self { simd, value: simd.transmute_f32s_u32s(bits) }
    }

    /// `self` in some worlds, elsewhere `otherwise`.
    #[inline(always)]
    pub fn where_true(self, worlds: S::m32s, otherwise: Self) -> Self {
        let simd = self.simd;
        // As bits: pulp's selection of floats is not always inlined.
        let bits = |lane: Self| simd.transmute_u32s_f32s(lane.value);
        let chosen = simd.select_u32s(worlds, bits(self), bits(otherwise));
        Self { simd, value: simd.transmute_f32s_u32s(chosen) }
    }

    /// The worlds in which `self` is above `limit`.
    #[inline(always)]
    fn above(self, limit: Self) -> S::m32s {
        self.simd.greater_than_f32s(self.value, limit.value)
    }

    /// Whether `self` is above `limit` in any world.
    #[inline(always)]
    pub fn any_above(self, limit: Self) -> bool {
        self.simd.first_true_m32s(self.above(limit)) < S::F32_LANES
    }

    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self { simd: self.simd, value: self.simd.sqrt_f32s(self.value) }
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
        /// 1.5 * 2^23: a sum with it is rounded to a whole number, which stands in its low bits.
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
        let bits = |lane: Self| simd.transmute_u32s_f32s(lane.value);
        let lane = |bits| Self { simd, value: simd.transmute_f32s_u32s(bits) };
        let count = bits(shifted);
        let (zero, one) = (simd.splat_u32s(0), simd.splat_u32s(1));
        let (two, sign) = (simd.splat_u32s(2), simd.splat_u32s(1 << 31));
        let is_odd = simd.sub_u32s(zero, simd.and_u32s(count, one));
        let swap = simd.and_u32s(is_odd, simd.xor_u32s(bits(sine), bits(cosine)));
        // 0 - 2 has the sign bit, 0 - 0 has not.
        let sign_of = |count| simd.and_u32s(sign, simd.sub_u32s(zero, simd.and_u32s(count, two)));
        let s = simd.xor_u32s(simd.xor_u32s(bits(sine), swap), sign_of(count));
        let c = simd.xor_u32s(simd.xor_u32s(bits(cosine), swap), sign_of(simd.add_u32s(count, one)));
        (lane(s), lane(c))
    }
}

/// Sine and cosine of two angles. Most joints bend by less than an eighth of a turn; the reduction by no quarter turn at
/// all is exact, so that leaving it out changes no bit.
#[inline(always)]
pub(crate) fn sin_cos_pair<S: Simd>(a: Lane<S>, b: Lane<S>) -> [(Lane<S>, Lane<S>); 2] {
    /// Just under pi/4.
    const EIGHTH: f32 = 0.785;
    let simd = a.simd;
    let size = |x: Lane<S>| simd.abs_f32s(x.value);
    let largest = Lane { simd, value: simd.max_f32s(size(a), size(b)) };
    if largest.any_above(Lane::splat(simd, EIGHTH)) {
        [a.sin_cos(), b.sin_cos()]
    } else {
        [a.sin_cos_within_an_eighth(), b.sin_cos_within_an_eighth()]
    }
}

/// The worlds in which the bits of a mask are set.
#[inline(always)]
pub(crate) fn lanes_of<S: Simd>(simd: S, mask: S::f32s) -> S::m32s {
    simd.equal_u32s(simd.transmute_u32s_f32s(mask), simd.splat_u32s(u32::MAX))
}

#[inline(always)]
pub(crate) fn load3<S: Simd>(simd: S, from: &[S::f32s]) -> Lane3<S> {
    [Lane::load(simd, from[0]), Lane::load(simd, from[1]), Lane::load(simd, from[2])]
}

#[inline(always)]
pub(crate) fn store3<S: Simd>(to: &mut [S::f32s], v: Lane3<S>) {
    for (to, v) in to.iter_mut().zip(v) {
        *to = v.value;
    }
}

#[inline(always)]
pub(crate) fn add<S: Simd>(a: Lane3<S>, b: Lane3<S>) -> Lane3<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn sub<S: Simd>(a: Lane3<S>, b: Lane3<S>) -> Lane3<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn scale<S: Simd>(s: Lane<S>, v: Lane3<S>) -> Lane3<S> {
    [s * v[0], s * v[1], s * v[2]]
}

/// `s v + c`.
#[inline(always)]
pub(crate) fn axpy<S: Simd>(s: Lane<S>, v: Lane3<S>, c: Lane3<S>) -> Lane3<S> {
    [s.mul_add(v[0], c[0]), s.mul_add(v[1], c[1]), s.mul_add(v[2], c[2])]
}

/// `c - s v`.
#[inline(always)]
pub(crate) fn axmy<S: Simd>(s: Lane<S>, v: Lane3<S>, c: Lane3<S>) -> Lane3<S> {
    [s.take_from(v[0], c[0]), s.take_from(v[1], c[1]), s.take_from(v[2], c[2])]
}

#[inline(always)]
pub(crate) fn dot<S: Simd>(a: Lane3<S>, b: Lane3<S>) -> Lane<S> {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// `a . b + c`.
#[inline(always)]
pub(crate) fn dot_add<S: Simd>(a: Lane3<S>, b: Lane3<S>, c: Lane<S>) -> Lane<S> {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2].mul_add(b[2], c)))
}

#[inline(always)]
pub(crate) fn cross<S: Simd>(a: Lane3<S>, b: Lane3<S>) -> Lane3<S> {
    [
        a[1].mul_add(b[2], -(a[2] * b[1])),
        a[2].mul_add(b[0], -(a[0] * b[2])),
        a[0].mul_add(b[1], -(a[1] * b[0])),
    ]
}

/// `a x b + c`.
#[inline(always)]
pub(crate) fn cross_add<S: Simd>(a: Lane3<S>, b: Lane3<S>, c: Lane3<S>) -> Lane3<S> {
    [
        a[1].mul_add(b[2], a[2].take_from(b[1], c[0])),
        a[2].mul_add(b[0], a[0].take_from(b[2], c[1])),
        a[0].mul_add(b[1], a[1].take_from(b[0], c[2])),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_geometry::math;

    #[test]
    fn sine_and_cosine() {
        let mut worst = 0.0_f64;
        for k in -40_000..40_000 {
            let angle = k as f32 * 1.234e-3;
            let (s, c) = Lane::splat(pulp::Scalar, angle).sin_cos();
            let (s_exact, c_exact) = math::sin_cos(f64::from(angle));
            worst = worst.max((f64::from(s.value) - s_exact).abs()).max((f64::from(c.value) - c_exact).abs());
        }
        // One unit in the last place of a number near 1, and the reduction's rest at 50 rad.
        assert!(worst < 1.5e-7, "{worst}");
    }
}
