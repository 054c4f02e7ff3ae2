//! Interface of the passes to a set of vector instructions: those that pulp finds at run time, and the set that every processor of
//! a target has (SSE2 on x86-64), which pulp lacks and `wide` has.

use pulp::{Simd, bytemuck};
use wide::{f32x4, u32x4};

/// A set of vector instructions. A vector has one entry a world.
pub(crate) trait Instructions: Copy {
    /// A vector of f32.
    type Vector: Copy + bytemuck::Pod;
    /// Such a vector as bits.
    type Bits: Copy + bytemuck::Pod;
    /// Some of the worlds.
    type Worlds: Copy;

    /// Worlds a vector.
    const LANES: usize;
    /// True if a product and sum are rounded once.
    const IS_FUSED: bool;

    /// Repeats a number in every world.
    fn splat(self, number: f32) -> Self::Vector;
    /// a + b.
    fn add(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// a - b.
    fn sub(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// a b.
    fn mul(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// a / b.
    fn div(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// -a.
    fn neg(self, a: Self::Vector) -> Self::Vector;
    /// |a|.
    fn abs(self, a: Self::Vector) -> Self::Vector;
    /// The larger of a and b; either if one is no number.
    fn max(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// The root of a.
    fn sqrt(self, a: Self::Vector) -> Self::Vector;
    /// a b + c, rounded once if [`Self::IS_FUSED`].
    fn mul_add(self, a: Self::Vector, b: Self::Vector, c: Self::Vector) -> Self::Vector;
    /// c - a b, likewise.
    fn take_from(self, a: Self::Vector, b: Self::Vector, c: Self::Vector) -> Self::Vector;

    /// The bits of a vector.
    fn bits(self, a: Self::Vector) -> Self::Bits;
    /// The vector of some bits.
    fn vector(self, a: Self::Bits) -> Self::Vector;
    /// Repeats bits in every world.
    fn splat_bits(self, bits: u32) -> Self::Bits;
    /// a & b.
    fn and(self, a: Self::Bits, b: Self::Bits) -> Self::Bits;
    /// a ^ b.
    fn xor(self, a: Self::Bits, b: Self::Bits) -> Self::Bits;
    /// a + b as whole numbers.
    fn add_bits(self, a: Self::Bits, b: Self::Bits) -> Self::Bits;
    /// a - b as whole numbers.
    fn sub_bits(self, a: Self::Bits, b: Self::Bits) -> Self::Bits;

    /// The worlds in which all bits are set, not none.
    fn worlds(self, a: Self::Bits) -> Self::Worlds;
    /// The worlds in which a > b.
    fn above(self, a: Self::Vector, b: Self::Vector) -> Self::Worlds;
    /// True if it holds in any world.
    fn any(self, worlds: Self::Worlds) -> bool;
    /// `a` in some worlds, elsewhere `b`.
    fn select(self, worlds: Self::Worlds, a: Self::Vector, b: Self::Vector) -> Self::Vector;
}

impl<S: Simd> Instructions for S {
    type Vector = S::f32s;
    type Bits = S::u32s;
    type Worlds = S::m32s;

    const LANES: usize = S::F32_LANES;
    // AVX2, AVX-512 and NEON; no other set of pulp's is run.
    const IS_FUSED: bool = true;

    #[inline(always)]
    fn splat(self, number: f32) -> S::f32s {
        self.splat_f32s(number)
    }
    #[inline(always)]
    fn add(self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.add_f32s(a, b)
    }
    #[inline(always)]
    fn sub(self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.sub_f32s(a, b)
    }
    #[inline(always)]
    fn mul(self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.mul_f32s(a, b)
    }
    #[inline(always)]
    fn div(self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.div_f32s(a, b)
    }
    #[inline(always)]
    fn neg(self, a: S::f32s) -> S::f32s {
        self.neg_f32s(a)
    }
    #[inline(always)]
    fn abs(self, a: S::f32s) -> S::f32s {
        self.abs_f32s(a)
    }
    #[inline(always)]
    fn max(self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.max_f32s(a, b)
    }
    #[inline(always)]
    fn sqrt(self, a: S::f32s) -> S::f32s {
        self.sqrt_f32s(a)
    }
    #[inline(always)]
    fn mul_add(self, a: S::f32s, b: S::f32s, c: S::f32s) -> S::f32s {
        self.mul_add_e_f32s(a, b, c)
    }
    #[inline(always)]
    fn take_from(self, a: S::f32s, b: S::f32s, c: S::f32s) -> S::f32s {
        self.negate_mul_add_e_f32s(a, b, c)
    }
    #[inline(always)]
    fn bits(self, a: S::f32s) -> S::u32s {
        self.transmute_u32s_f32s(a)
    }
    #[inline(always)]
    fn vector(self, a: S::u32s) -> S::f32s {
        self.transmute_f32s_u32s(a)
    }
    #[inline(always)]
    fn splat_bits(self, bits: u32) -> S::u32s {
        self.splat_u32s(bits)
    }
    #[inline(always)]
    fn and(self, a: S::u32s, b: S::u32s) -> S::u32s {
        self.and_u32s(a, b)
    }
    #[inline(always)]
    fn xor(self, a: S::u32s, b: S::u32s) -> S::u32s {
        self.xor_u32s(a, b)
    }
    #[inline(always)]
    fn add_bits(self, a: S::u32s, b: S::u32s) -> S::u32s {
        self.add_u32s(a, b)
    }
    #[inline(always)]
    fn sub_bits(self, a: S::u32s, b: S::u32s) -> S::u32s {
        self.sub_u32s(a, b)
    }
    #[inline(always)]
    fn worlds(self, a: S::u32s) -> S::m32s {
        self.equal_u32s(a, self.splat_u32s(u32::MAX))
    }
    #[inline(always)]
    fn above(self, a: S::f32s, b: S::f32s) -> S::m32s {
        self.greater_than_f32s(a, b)
    }
    #[inline(always)]
    fn any(self, worlds: S::m32s) -> bool {
        self.first_true_m32s(worlds) < S::F32_LANES
    }
    #[inline(always)]
    fn select(self, worlds: S::m32s, a: S::f32s, b: S::f32s) -> S::f32s {
        // As bits: pulp's selection of floats is not always inlined.
        self.vector(self.select_u32s(worlds, self.bits(a), self.bits(b)))
    }
}

/// Four worlds a vector with the set that every processor of the target has: SSE2 on x86-64. Never fused, so that the same
/// bits come out on every target.
#[derive(Clone, Copy)]
pub(crate) struct Baseline;

impl Instructions for Baseline {
    type Vector = f32x4;
    type Bits = u32x4;
    type Worlds = f32x4;

    const LANES: usize = 4;
    const IS_FUSED: bool = false;

    #[inline(always)]
    fn splat(self, number: f32) -> f32x4 {
        f32x4::splat(number)
    }
    #[inline(always)]
    fn add(self, a: f32x4, b: f32x4) -> f32x4 {
        a + b
    }
    #[inline(always)]
    fn sub(self, a: f32x4, b: f32x4) -> f32x4 {
        a - b
    }
    #[inline(always)]
    fn mul(self, a: f32x4, b: f32x4) -> f32x4 {
        a * b
    }
    #[inline(always)]
    fn div(self, a: f32x4, b: f32x4) -> f32x4 {
        a / b
    }
    #[inline(always)]
    fn neg(self, a: f32x4) -> f32x4 {
        -a
    }
    #[inline(always)]
    fn abs(self, a: f32x4) -> f32x4 {
        a.abs()
    }
    #[inline(always)]
    fn max(self, a: f32x4, b: f32x4) -> f32x4 {
        a.fast_max(b)
    }
    #[inline(always)]
    fn sqrt(self, a: f32x4) -> f32x4 {
        a.sqrt()
    }
    #[inline(always)]
    fn mul_add(self, a: f32x4, b: f32x4, c: f32x4) -> f32x4 {
        a * b + c
    }
    #[inline(always)]
    fn take_from(self, a: f32x4, b: f32x4, c: f32x4) -> f32x4 {
        c - a * b
    }
    #[inline(always)]
    fn bits(self, a: f32x4) -> u32x4 {
        bytemuck::cast(a)
    }
    #[inline(always)]
    fn vector(self, a: u32x4) -> f32x4 {
        bytemuck::cast(a)
    }
    #[inline(always)]
    fn splat_bits(self, bits: u32) -> u32x4 {
        u32x4::splat(bits)
    }
    #[inline(always)]
    fn and(self, a: u32x4, b: u32x4) -> u32x4 {
        a & b
    }
    #[inline(always)]
    fn xor(self, a: u32x4, b: u32x4) -> u32x4 {
        a ^ b
    }
    #[inline(always)]
    fn add_bits(self, a: u32x4, b: u32x4) -> u32x4 {
        a + b
    }
    #[inline(always)]
    fn sub_bits(self, a: u32x4, b: u32x4) -> u32x4 {
        a - b
    }
    #[inline(always)]
    fn worlds(self, a: u32x4) -> f32x4 {
        bytemuck::cast(a.simd_eq(u32x4::splat(u32::MAX)))
    }
    #[inline(always)]
    fn above(self, a: f32x4, b: f32x4) -> f32x4 {
        a.simd_gt(b)
    }
    #[inline(always)]
    fn any(self, worlds: f32x4) -> bool {
        worlds.any()
    }
    #[inline(always)]
    fn select(self, worlds: f32x4, a: f32x4, b: f32x4) -> f32x4 {
        worlds.select(a, b)
    }
}
