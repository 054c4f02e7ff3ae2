//! Symmetric 3 x 3 matrices.

use std::ops::{AddAssign, Mul};

use orchard_geometry::{Mat3, Vec3};

/// A symmetric 3 x 3 matrix by its six entries.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Symmetric3 {
    pub xx: f64,
    pub xy: f64,
    pub xz: f64,
    pub yy: f64,
    pub yz: f64,
    pub zz: f64,
}

impl Symmetric3 {
    pub const ZERO: Symmetric3 = Symmetric3 { xx: 0.0, xy: 0.0, xz: 0.0, yy: 0.0, yz: 0.0, zz: 0.0 };

    /// `R A R^T` of a symmetric matrix A, of which only the upper triangle is read.
    #[inline]
    pub fn rotated(a: &Mat3, turn: &Mat3) -> Symmetric3 {
        let a = Symmetric3 {
            xx: a[(0, 0)],
            xy: a[(0, 1)],
            xz: a[(0, 2)],
            yy: a[(1, 1)],
            yz: a[(1, 2)],
            zz: a[(2, 2)],
        };
        let row = |k: usize| Vec3::new(turn[(k, 0)], turn[(k, 1)], turn[(k, 2)]);
        let (row_x, row_y, row_z) = (row(0), row(1), row(2));
        let (x, y, z) = (a * row_x, a * row_y, a * row_z);
        Symmetric3 {
            xx: row_x.dot(&x),
            xy: row_x.dot(&y),
            xz: row_x.dot(&z),
            yy: row_y.dot(&y),
            yz: row_y.dot(&z),
            zz: row_z.dot(&z),
        }
    }

    pub fn scaled(&self, by: f64) -> Symmetric3 {
        Symmetric3 {
            xx: self.xx * by,
            xy: self.xy * by,
            xz: self.xz * by,
            yy: self.yy * by,
            yz: self.yz * by,
            zz: self.zz * by,
        }
    }

    pub fn trace(&self) -> f64 {
        self.xx + self.yy + self.zz
    }

    /// Adds `by` to the diagonal.
    pub fn add_diagonal(&mut self, by: f64) {
        self.xx += by;
        self.yy += by;
        self.zz += by;
    }

    /// Subtracts `a b^T`, which the caller knows to be symmetric (or to become so in a sum).
    pub fn subtract_outer(&mut self, a: &Vec3, b: &Vec3) {
        self.xx -= a.x * b.x;
        self.xy -= a.x * b.y;
        self.xz -= a.x * b.z;
        self.yy -= a.y * b.y;
        self.yz -= a.y * b.z;
        self.zz -= a.z * b.z;
    }

    /// The columns.
    pub fn columns(&self) -> [Vec3; 3] {
        [
            Vec3::new(self.xx, self.xy, self.xz),
            Vec3::new(self.xy, self.yy, self.yz),
            Vec3::new(self.xz, self.yz, self.zz),
        ]
    }
}

impl Mul<Vec3> for Symmetric3 {
    type Output = Vec3;
    fn mul(self, v: Vec3) -> Vec3 {
        Vec3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }
}

impl AddAssign for Symmetric3 {
    fn add_assign(&mut self, other: Symmetric3) {
        self.xx += other.xx;
        self.xy += other.xy;
        self.xz += other.xz;
        self.yy += other.yy;
        self.yz += other.yz;
        self.zz += other.zz;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotation_is_that_of_the_full_matrix() {
        let a = Mat3::new(2.0, 0.1, 0.2, 0.1, 3.0, -0.3, 0.2, -0.3, 4.0);
        let turn =
            orchard_geometry::Rotation::from_scaled_axis(Vec3::new(0.3, -0.7, 1.1)).to_rotation_matrix();
        let expected = turn.matrix() * a * turn.matrix().transpose();
        let got = Symmetric3::rotated(&a, turn.matrix());
        assert!((Mat3::from_columns(&got.columns()) - expected).norm() < 1e-15);
        assert!((got * Vec3::new(1.0, 2.0, 3.0) - expected * Vec3::new(1.0, 2.0, 3.0)).norm() < 1e-14);
    }
}
