//! Symmetric 3 x 3 matrices.

use std::ops::{Add, AddAssign, Mul};

use nalgebra::Vector3;
use orchard_geometry::Mat3;

use crate::lanes::{Packed, Real};

/// A symmetric 3 x 3 matrix by its six entries.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Symmetric3<S = f64> {
    pub xx: S,
    pub xy: S,
    pub xz: S,
    pub yy: S,
    pub yz: S,
    pub zz: S,
}

impl Symmetric3 {
    pub const ZERO: Symmetric3 = Symmetric3 { xx: 0.0, xy: 0.0, xz: 0.0, yy: 0.0, yz: 0.0, zz: 0.0 };

    /// A symmetric matrix, of which only the upper triangle is read.
    pub fn of_upper(a: &Mat3) -> Symmetric3 {
        Symmetric3 {
            xx: a[(0, 0)],
            xy: a[(0, 1)],
            xz: a[(0, 2)],
            yy: a[(1, 1)],
            yz: a[(1, 2)],
            zz: a[(2, 2)],
        }
    }
}

impl<S: Real> Symmetric3<S> {
    /// A multiple of the identity.
    #[inline(always)]
    pub fn diagonal(by: S) -> Self {
        let zero = S::zero();
        Symmetric3 { xx: by, xy: zero, xz: zero, yy: by, yz: zero, zz: by }
    }

    /// `R A R^T`, R given by its columns.
    #[inline(always)]
    pub fn rotated(&self, turn: &[Vector3<S>; 3]) -> Self {
        if self.xy.is_zero() && self.xz.is_zero() && self.yz.is_zero() {
            return self.diagonal_rotated(turn);
        }
        let row = |k: usize| Vector3::new(turn[0][k], turn[1][k], turn[2][k]);
        let (row_x, row_y, row_z) = (row(0), row(1), row(2));
        let (x, y, z) = (*self * row_x, *self * row_y, *self * row_z);
        Symmetric3 {
            xx: row_x.dot(&x),
            xy: row_x.dot(&y),
            xz: row_x.dot(&z),
            yy: row_y.dot(&y),
            yz: row_y.dot(&z),
            zz: row_z.dot(&z),
        }
    }

    /// `R A R^T` of a diagonal matrix, as that of every capsule, in a third of the work:
    /// `a_x 1 + (a_y - a_x) y y^T + (a_z - a_x) z z^T`.
    #[inline(always)]
    fn diagonal_rotated(&self, [_, y, z]: &[Vector3<S>; 3]) -> Self {
        let mut rotated = Symmetric3::diagonal(self.xx);
        rotated.subtract_outer(&(y * (self.xx - self.yy)), y);
        rotated.subtract_outer(&(z * (self.xx - self.zz)), z);
        rotated
    }

    #[inline(always)]
    pub fn scaled(&self, by: S) -> Self {
        Symmetric3 {
            xx: self.xx * by,
            xy: self.xy * by,
            xz: self.xz * by,
            yy: self.yy * by,
            yz: self.yz * by,
            zz: self.zz * by,
        }
    }

    #[inline(always)]
    pub fn trace(&self) -> S {
        self.xx + self.yy + self.zz
    }

    /// Adds `by` to the diagonal.
    #[inline(always)]
    pub fn add_diagonal(&mut self, by: S) {
        self.xx += by;
        self.yy += by;
        self.zz += by;
    }

    /// Subtracts `a b^T`, which must be symmetric (or become so in a sum).
    #[inline(always)]
    pub fn subtract_outer(&mut self, a: &Vector3<S>, b: &Vector3<S>) {
        self.xx -= a.x * b.x;
        self.xy -= a.x * b.y;
        self.xz -= a.x * b.z;
        self.yy -= a.y * b.y;
        self.yz -= a.y * b.z;
        self.zz -= a.z * b.z;
    }

    /// The columns.
    #[inline(always)]
    pub fn columns(&self) -> [Vector3<S>; 3] {
        [
            Vector3::new(self.xx, self.xy, self.xz),
            Vector3::new(self.xy, self.yy, self.yz),
            Vector3::new(self.xz, self.yz, self.zz),
        ]
    }
}

impl<S: Real> Packed for Symmetric3<S> {
    type Lane = Symmetric3;

    #[inline(always)]
    fn pack(of: impl Fn(usize) -> Symmetric3) -> Self {
        Symmetric3 {
            xx: S::pack(|l| of(l).xx),
            xy: S::pack(|l| of(l).xy),
            xz: S::pack(|l| of(l).xz),
            yy: S::pack(|l| of(l).yy),
            yz: S::pack(|l| of(l).yz),
            zz: S::pack(|l| of(l).zz),
        }
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> Symmetric3 {
        Symmetric3 {
            xx: self.xx.lane(lane),
            xy: self.xy.lane(lane),
            xz: self.xz.lane(lane),
            yy: self.yy.lane(lane),
            yz: self.yz.lane(lane),
            zz: self.zz.lane(lane),
        }
    }
}

impl<S: Real> Mul<Vector3<S>> for Symmetric3<S> {
    type Output = Vector3<S>;
    #[inline(always)]
    fn mul(self, v: Vector3<S>) -> Vector3<S> {
        Vector3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }
}

impl<S: Real> Add for Symmetric3<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Symmetric3 {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            xz: self.xz + other.xz,
            yy: self.yy + other.yy,
            yz: self.yz + other.yz,
            zz: self.zz + other.zz,
        }
    }
}

impl<S: Real> AddAssign for Symmetric3<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use orchard_geometry::Vec3;

    use super::*;

    fn turn() -> Mat3 {
        orchard_geometry::Rotation::from_scaled_axis(Vec3::new(0.3, -0.7, 1.1))
            .to_rotation_matrix()
            .into_inner()
    }

    fn rotated(a: &Mat3) -> Symmetric3 {
        Symmetric3::of_upper(a).rotated(&[0, 1, 2].map(|k| turn().column(k).into_owned()))
    }

    #[test]
    fn rotation_is_that_of_the_full_matrix() {
        let a = Mat3::new(2.0, 0.1, 0.2, 0.1, 3.0, -0.3, 0.2, -0.3, 4.0);
        let (got, expected) = (rotated(&a), turn() * a * turn().transpose());
        assert!((Mat3::from_columns(&got.columns()) - expected).norm() < 1e-15);
        assert!((got * Vec3::new(1.0, 2.0, 3.0) - expected * Vec3::new(1.0, 2.0, 3.0)).norm() < 1e-14);
    }

    #[test]
    fn a_diagonal_matrix_rotates_likewise() {
        let a = Mat3::from_diagonal(&Vec3::new(2.0, 3.0, 4.0));
        let got = Mat3::from_columns(&rotated(&a).columns());
        // Nine entries, each of a few sums that round at up to 4.
        assert!((got - turn() * a * turn().transpose()).norm() < 9.0 * 4.0 * f64::EPSILON);
    }
}
