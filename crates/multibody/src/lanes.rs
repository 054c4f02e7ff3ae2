//! Numbers of the kernels over links: one f64, or two side by side.
//!
//! Two links, neither an ancestor of the other, do not depend on each other, and a processor computes on two f64
//! as fast as on one. Lanes never mix and nothing is contracted, so that the bits are those of one number at a
//! time, on every processor.

use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign, Scalar, Vector3};
use num_traits::{One, Zero};
use orchard_geometry::{Vec3, math};
use wide::f64x2;

/// A number of the kernels: `LANES` values with the same operations.
pub(crate) trait Real:
    Packed<Lane = f64>
    + Scalar
    + Default
    + Zero
    + One
    + ClosedAddAssign
    + ClosedSubAssign
    + ClosedMulAssign
    + ClosedDivAssign
    + Neg<Output = Self>
{
    /// A value repeated in every lane.
    fn splat(value: f64) -> Self;

    /// The inverse in the lanes where it is above `floor`, 0 in the others.
    fn inverse_above(self, floor: Self) -> Self;

    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
}

impl Real for f64 {
    #[inline(always)]
    fn splat(value: f64) -> f64 {
        value
    }

    #[inline(always)]
    fn inverse_above(self, floor: f64) -> f64 {
        if self > floor { 1.0 / self } else { 0.0 }
    }

    #[inline(always)]
    fn sin_cos(self) -> (f64, f64) {
        math::sin_cos(self)
    }
}

/// Two values side by side.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Pair(f64x2);

impl Real for Pair {
    #[inline(always)]
    fn splat(value: f64) -> Pair {
        Pair(f64x2::splat(value))
    }

    #[inline(always)]
    fn inverse_above(self, floor: Pair) -> Pair {
        let is_above = self.0.simd_gt(floor.0);
        Pair(is_above.bitselect(f64x2::ONE / self.0, f64x2::ZERO))
    }

    #[inline(always)]
    fn sin_cos(self) -> (Pair, Pair) {
        let [first, second] = self.0.to_array();
        if first.abs() <= math::SMALL_ANGLE && second.abs() <= math::SMALL_ANGLE {
            return math::sin_cos_small(self, Pair::splat);
        }
        let ((s_0, c_0), (s_1, c_1)) = (math::sin_cos(first), math::sin_cos(second));
        (Pair(f64x2::new([s_0, s_1])), Pair(f64x2::new([c_0, c_1])))
    }
}

macro_rules! lane_by_lane {
    ($($operator:ident $function:ident, $assign:ident $assign_function:ident;)*) => {$(
        impl $operator for Pair {
            type Output = Pair;
            #[inline(always)]
            fn $function(self, other: Pair) -> Pair {
                Pair($operator::$function(self.0, other.0))
            }
        }

        impl $assign for Pair {
            #[inline(always)]
            fn $assign_function(&mut self, other: Pair) {
                *self = $operator::$function(*self, other);
            }
        }
    )*};
}

lane_by_lane! {
    Add add, AddAssign add_assign;
    Sub sub, SubAssign sub_assign;
    Mul mul, MulAssign mul_assign;
    Div div, DivAssign div_assign;
}

impl Neg for Pair {
    type Output = Pair;
    #[inline(always)]
    fn neg(self) -> Pair {
        Pair(-self.0)
    }
}

impl Zero for Pair {
    #[inline(always)]
    fn zero() -> Pair {
        Pair(f64x2::ZERO)
    }

    #[inline(always)]
    fn is_zero(&self) -> bool {
        *self == Pair::zero()
    }
}

impl One for Pair {
    #[inline(always)]
    fn one() -> Pair {
        Pair(f64x2::ONE)
    }
}

/// Types made of numbers: the kernels hold one item for each lane.
pub(crate) trait Packed: Copy + Default {
    /// Value of a lane.
    type Lane: Copy;

    /// Packs the item of each lane.
    fn pack(of: impl Fn(usize) -> Self::Lane) -> Self;

    /// Returns the item of a lane.
    fn lane(&self, lane: usize) -> Self::Lane;
}

/// Looks up an item of the link in each lane; a single link fills both.
#[inline(always)]
pub(crate) fn each<T>(links: &[usize], of: impl Fn(usize) -> T) -> [T; 2] {
    [of(links[0]), of(links[links.len() - 1])]
}

/// The first N consecutive items, for each lane.
#[inline(always)]
pub(crate) fn pack_rows<P: Packed, const N: usize>(rows: [&[P::Lane]; 2]) -> [P; N] {
    let rows = [&rows[0][..N], &rows[1][..N]];
    let mut packed = [P::default(); N];
    for (k, packed) in packed.iter_mut().enumerate() {
        *packed = P::pack(|l| rows[l][k]);
    }
    packed
}

impl Packed for f64 {
    type Lane = f64;

    #[inline(always)]
    fn pack(of: impl Fn(usize) -> f64) -> f64 {
        of(0)
    }

    #[inline(always)]
    fn lane(&self, _: usize) -> f64 {
        *self
    }
}

impl Packed for Pair {
    type Lane = f64;

    #[inline(always)]
    fn pack(of: impl Fn(usize) -> f64) -> Pair {
        Pair(f64x2::new([of(0), of(1)]))
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> f64 {
        self.0.to_array()[lane]
    }
}

impl<S: Real> Packed for Vector3<S> {
    type Lane = Vec3;

    #[inline(always)]
    fn pack(of: impl Fn(usize) -> Vec3) -> Vector3<S> {
        Vector3::new(S::pack(|l| of(l).x), S::pack(|l| of(l).y), S::pack(|l| of(l).z))
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x.lane(lane), self.y.lane(lane), self.z.lane(lane))
    }
}

impl<S: Real> Packed for [Vector3<S>; 3] {
    type Lane = [Vec3; 3];

    #[inline(always)]
    fn pack(of: impl Fn(usize) -> [Vec3; 3]) -> [Vector3<S>; 3] {
        [Vector3::pack(|l| of(l)[0]), Vector3::pack(|l| of(l)[1]), Vector3::pack(|l| of(l)[2])]
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> [Vec3; 3] {
        [self[0].lane(lane), self[1].lane(lane), self[2].lane(lane)]
    }
}
