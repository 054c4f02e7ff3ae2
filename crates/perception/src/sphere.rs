//! Linear least-squares fit of a sphere.

use orchard_geometry::{Mat3, Vec3};

/// A sphere, in the frame of the points that it is fitted to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Centre \[m\].
    pub center: Vec3,
    /// Radius \[m\].
    pub radius: f64,
}

/// Least determinant of the points' scatter matrix relative to that of a ball of the same extent. Below it the points lie in a plane
/// within the resolution of f32 depth (relative step 6e-8, squared, with a wide margin).
const FLAT: f64 = 1e-11;

impl Sphere {
    /// Least number of points that determine a sphere.
    pub const MIN_POINTS: usize = 4;

    /// Fits a sphere by least squares on 2 p.c + b = |p|^2 with b = R^2 - |c|^2 (paper, eq. "spherefit"). Returns `None` for fewer
    /// than four points and for points in a plane.
    pub fn fit(mut points: impl Iterator<Item = Vec3>) -> Option<Self> {
        let first = points.next()?;
        let mut moments = Moments::about(first);
        moments.add(&first);
        points.for_each(|p| moments.add(&p));
        moments.sphere().map(|(sphere, _)| sphere)
    }

    /// Returns the signed distance of a point from the surface \[m\], negative inside.
    pub fn residual(&self, p: &Vec3) -> f64 {
        (p - self.center).norm() - self.radius
    }

    /// Returns the root mean square of the residuals \[m\]; zero for no points.
    pub fn rms(&self, points: impl Iterator<Item = Vec3>) -> f64 {
        root_mean_square(points.map(|p| self.residual(&p)))
    }
}

/// Sums over points q = p - origin from which the fitted sphere follows. The origin should lie among the points, so that no digits
/// cancel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moments {
    origin: Vec3,
    count: usize,
    q: Vec3,
    /// Sum of q q^T: xx, xy, xz, yy, yz, zz.
    qq: [f64; 6],
    /// Sum of q |q|^2.
    q_square: Vec3,
    /// Sum of |q|^4.
    fourth: f64,
}

impl Moments {
    pub(crate) fn about(origin: Vec3) -> Self {
        Self { origin, count: 0, q: Vec3::zeros(), qq: [0.0; 6], q_square: Vec3::zeros(), fourth: 0.0 }
    }

    pub(crate) fn origin(&self) -> Vec3 {
        self.origin
    }

    #[inline]
    pub(crate) fn add(&mut self, p: &Vec3) {
        let q = p - self.origin;
        let products = [q.x * q.x, q.x * q.y, q.x * q.z, q.y * q.y, q.y * q.z, q.z * q.z];
        let square = products[0] + products[3] + products[5];
        self.count += 1;
        self.q += q;
        for (sum, product) in self.qq.iter_mut().zip(products) {
            *sum += product;
        }
        self.q_square += q * square;
        self.fourth += square * square;
    }

    /// Returns the least-squares sphere and the root mean square of its residuals to first order \[m\].
    ///
    /// In coordinates q' = q - m about the centroid the normal equations decouple: b is the mean of |q'|^2, and
    /// 2 (sum q' q'^T) c = sum q' |q'|^2. The residual sum of squares, sum |q'|^4 - 2 c . sum q' |q'|^2 - n b^2, is the sum of
    /// ((d - R) (d + R))^2, about 4 R^2 (d - R)^2, over the distances d from the centre.
    pub(crate) fn sphere(&self) -> Option<(Sphere, f64)> {
        if self.count < Sphere::MIN_POINTS {
            return None;
        }
        let n = self.count as f64;
        let m = self.q / n;
        let mm = m.norm_squared();
        let [xx, xy, xz, yy, yz, zz] = self.qq;
        let about_origin = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let square = xx + yy + zz;
        let qq_m = about_origin * m;
        let scatter = about_origin - m * m.transpose() * n;
        let moment = self.q_square - qq_m * 2.0 - m * (square - 2.0 * n * mm);
        let fourth = self.fourth - 4.0 * m.dot(&self.q_square) + 4.0 * m.dot(&qq_m) + 2.0 * mm * square
            - 3.0 * n * mm * mm;
        let scale = scatter.trace() / 3.0;
        let flatness = scatter.determinant() / (scale * scale * scale);
        if flatness.is_nan() || flatness < FLAT {
            return None;
        }
        let center = scatter.cholesky()?.solve(&moment) * 0.5;
        let b = square / n - mm;
        let radius = (b + center.norm_squared()).sqrt();
        let left = (fourth - 2.0 * center.dot(&moment) - n * b * b).max(0.0);
        let rms = (left / n).sqrt() / (2.0 * radius);
        (radius.is_finite() && rms.is_finite())
            .then(|| (Sphere { center: self.origin + m + center, radius }, rms))
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
