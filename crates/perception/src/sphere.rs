//! The linear least-squares sphere.

use orchard_geometry::{Mat3, Vec3};

/// A sphere in the frame of its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Centre [m].
    pub center: Vec3,
    /// Radius [m].
    pub radius: f64,
}

/// Points whose scatter matrix has a smaller determinant, relative to that of a ball of the same extent, lie
/// in a plane as far as f32 depth can tell (its relative step is 6e-8, squared and with a wide margin).
const FLAT: f64 = 1e-11;

impl Sphere {
    /// Fewest points that determine a sphere.
    pub const MIN_POINTS: usize = 4;

    /// Least-squares solution of 2 p.c + b = |p|^2 with b = R^2 - |c|^2 (paper, eq. "spherefit").
    ///
    /// In coordinates q about the centroid the normal equations decouple: b is the mean of |q|^2, and
    /// 2 (sum q q^T) c = sum q |q|^2. `None` for fewer than four points or points in a plane.
    pub fn fit(points: impl Iterator<Item = Vec3> + Clone) -> Option<Self> {
        let (mut count, mut mean) = (0, Vec3::zeros());
        for p in points.clone() {
            count += 1;
            mean += p;
        }
        if count < Self::MIN_POINTS {
            return None;
        }
        let n = count as f64;
        mean /= n;
        let (mut scatter, mut moment, mut square) = (Mat3::zeros(), Vec3::zeros(), 0.0);
        for p in points {
            let q = p - mean;
            let qq = q.norm_squared();
            scatter += q * q.transpose();
            moment += q * qq;
            square += qq;
        }
        let scale = scatter.trace() / 3.0;
        let flatness = scatter.determinant() / (scale * scale * scale);
        if flatness.is_nan() || flatness < FLAT {
            return None;
        }
        let center = scatter.cholesky()?.solve(&moment) * 0.5;
        let radius = (square / n + center.norm_squared()).sqrt();
        radius.is_finite().then(|| Self { center: mean + center, radius })
    }

    /// Signed distance of a point from the surface [m].
    pub fn residual(&self, p: &Vec3) -> f64 {
        (p - self.center).norm() - self.radius
    }

    /// Root mean square of the residuals [m]; zero for no points.
    pub fn rms(&self, points: impl Iterator<Item = Vec3>) -> f64 {
        root_mean_square(points.map(|p| self.residual(&p)))
    }
}

pub(crate) fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0_f64);
    for x in values {
        sum += x * x;
        n += 1.0;
    }
    (sum / n.max(1.0)).sqrt()
}
