//! Rotations inside the kernels.

use nalgebra::{Quaternion, Vector3};
use orchard_geometry::{Rotation, Vec3};

use crate::lanes::{Packed, Real};

/// A unit quaternion.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Turn<S: Real> {
    pub vector: Vector3<S>,
    pub scalar: S,
}

impl<S: Real> Turn<S> {
    /// `self` after `first`.
    #[inline(always)]
    pub fn after(&self, first: &Turn<S>) -> Turn<S> {
        Turn {
            vector: first.vector * self.scalar
                + self.vector * first.scalar
                + self.vector.cross(&first.vector),
            scalar: self.scalar * first.scalar - self.vector.dot(&first.vector),
        }
    }

    /// The turned axes: the columns of the rotation matrix.
    #[inline(always)]
    pub fn columns(&self) -> [Vector3<S>; 3] {
        let (one, w) = (S::one(), self.scalar);
        let (x, y, z) = (self.vector.x, self.vector.y, self.vector.z);
        let (x2, y2, z2) = (x + x, y + y, z + z);
        let (xx, xy, xz, yy, yz, zz) = (x * x2, x * y2, x * z2, y * y2, y * z2, z * z2);
        let (wx, wy, wz) = (w * x2, w * y2, w * z2);
        [
            Vector3::new(one - (yy + zz), xy + wz, xz - wy),
            Vector3::new(xy - wz, one - (xx + zz), yz + wx),
            Vector3::new(xz + wy, yz - wx, one - (xx + yy)),
        ]
    }
}

impl<S: Real> Packed for Turn<S> {
    type Lane = Rotation;

    #[inline(always)]
    fn pack(of: impl Fn(usize) -> Rotation) -> Turn<S> {
        Turn { vector: Vector3::pack(|l| Vec3::new(of(l).i, of(l).j, of(l).k)), scalar: S::pack(|l| of(l).w) }
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> Rotation {
        Rotation::new_unchecked(Quaternion::from_parts(self.scalar.lane(lane), self.vector.lane(lane)))
    }
}

/// `x a + y b + z c` of three axes a, b, c: a vector of their frame in the frame that they are given in.
#[inline(always)]
pub(crate) fn combine<S: Real>(axes: &[Vector3<S>; 3], vector: &Vector3<S>) -> Vector3<S> {
    axes[0] * vector.x + axes[1] * vector.y + axes[2] * vector.z
}
