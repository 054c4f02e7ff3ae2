//! Least-squares fit of a cylinder, for the comparison with the sphere.

use crate::sphere::root_mean_square;
use nalgebra::{Matrix3x6, Matrix6, Vector6};
use orchard_geometry::{Vec3, math};
use std::sync::OnceLock;

/// Number of directions of the coarse search, spread over half the sphere (about 20 degrees apart).
const DIRECTIONS: usize = 48;
/// First step of the fine search, the spacing of the coarse directions \[rad\].
const FIRST_STEP: f64 = 0.3;
/// Number of halvings of the fine search's step: down to FIRST_STEP / 64, 0.3 degrees.
const HALVINGS: usize = 6;
/// Least determinant of the second moments relative to their trace squared; below it the points are a line.
const LINE: f64 = 1e-12;

/// Returns the least RMS radial residual \[m\] of a cylinder of free axis and radius through the points; infinity if none can be fitted.
/// For each axis direction the circle across it is a linear least-squares fit, as for the sphere; the direction is searched coarse to
/// fine.
pub(crate) fn best_rms(points: &[Vec3]) -> f64 {
    let mean = points.iter().sum::<Vec3>() / points.len().max(1) as f64;
    let moments = Moments::new(points.iter().map(|p| p - mean));
    let mut best: (f64, Vec3, Option<Circle>) = (f64::INFINITY, Vec3::z(), None);
    let consider = |best: &mut (f64, Vec3, Option<Circle>), axis: &Axis| {
        if let Some(circle) = moments.circle(axis).filter(|circle| circle.rms < best.0) {
            *best = (circle.rms, axis.along, Some(circle));
        }
    };
    for axis in coarse_directions() {
        consider(&mut best, axis);
    }
    let mut step = FIRST_STEP;
    for _ in 0..HALVINGS {
        let (e1, e2) = across(&best.1);
        for (a, b) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            let axis = best.1 + (e1 * a + e2 * b) * step;
            consider(&mut best, &Axis::new(axis.normalize()));
        }
        step *= 0.5;
    }
    let (_, axis, Some(circle)) = best else { return f64::INFINITY };
    root_mean_square(points.iter().map(|p| {
        let q = p - mean - circle.center;
        (q - axis * q.dot(&axis)).norm() - circle.radius
    }))
}

/// Directions of the coarse search.
fn coarse_directions() -> &'static [Axis; DIRECTIONS] {
    static ALL: OnceLock<[Axis; DIRECTIONS]> = OnceLock::new();
    ALL.get_or_init(|| std::array::from_fn(|i| Axis::new(half_sphere_direction(i, DIRECTIONS))))
}

/// Direction of a cylinder's axis, with two across it and the weights w of the products k in the squared distance from it.
struct Axis {
    along: Vec3,
    across: (Vec3, Vec3),
    w: Vector6<f64>,
}

impl Axis {
    fn new(a: Vec3) -> Self {
        let w = Vector6::new(
            1.0 - a.x * a.x,
            1.0 - a.y * a.y,
            1.0 - a.z * a.z,
            -2.0 * a.x * a.y,
            -2.0 * a.x * a.z,
            -2.0 * a.y * a.z,
        );
        Self { along: a, across: across(&a), w }
    }
}

/// Returns point `i` of `n` of a Fibonacci lattice over the half sphere z > 0.
fn half_sphere_direction(i: usize, n: usize) -> Vec3 {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let z = (i as f64 + 0.5) / n as f64;
    let (sin, cos) = math::sin_cos(golden_angle * i as f64);
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

/// Returns two unit vectors that are perpendicular to a unit vector and to each other.
fn across(axis: &Vec3) -> (Vec3, Vec3) {
    let reference = if axis.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let e1 = axis.cross(&reference).normalize();
    (e1, axis.cross(&e1))
}

/// A circle across an axis; the centre is relative to the mean of the points.
struct Circle {
    center: Vec3,
    radius: f64,
    /// Root mean square of the residuals to first order \[m\].
    rms: f64,
}

/// Sums over points q about their mean of the products k = (xx, yy, zz, xy, xz, yz); the circle across any axis follows from these sums
/// alone. The squared distance from the axis a through the mean is |q|^2 - (q.a)^2 = w.k with
/// w = (1 - ax^2, 1 - ay^2, 1 - az^2, -2 ax ay, -2 ax az, -2 ay az).
struct Moments {
    count: f64,
    k: Vector6<f64>,
    q_k: Matrix3x6<f64>,
    k_k: Matrix6<f64>,
}

impl Moments {
    fn new(points: impl Iterator<Item = Vec3>) -> Self {
        let (mut count, mut k_sum) = (0.0, Vector6::zeros());
        let (mut q_k, mut k_k) = (Matrix3x6::zeros(), Matrix6::zeros());
        for q in points {
            let k = Vector6::new(q.x * q.x, q.y * q.y, q.z * q.z, q.x * q.y, q.x * q.z, q.y * q.z);
            count += 1.0;
            k_sum += k;
            q_k += q * k.transpose();
            k_k += k * k.transpose();
        }
        Self { count, k: k_sum, q_k, k_k }
    }

    /// Returns the least-squares circle of the points projected along an axis; `None` if they are a line.
    fn circle(&self, axis: &Axis) -> Option<Circle> {
        let Axis { across: (e1, e2), w, .. } = axis;
        let k = &self.k;
        let second = orchard_geometry::Mat3::new(k[0], k[3], k[4], k[3], k[1], k[5], k[4], k[5], k[2]);
        let (second_e1, second_e2) = (second * e1, second * e2);
        let (sxx, sxy, syy) = (e1.dot(&second_e1), e1.dot(&second_e2), e2.dot(&second_e2));
        let square = w.dot(k);
        let det = sxx * syy - sxy * sxy;
        let flatness = det / (square * square);
        if flatness.is_nan() || flatness < LINE {
            return None;
        }
        let third = self.q_k * w;
        let (mx, my) = (e1.dot(&third), e2.dot(&third));
        let (cx, cy) = (0.5 * (syy * mx - sxy * my) / det, 0.5 * (sxx * my - sxy * mx) / det);
        let b = square / self.count;
        let radius = (b + cx * cx + cy * cy).sqrt();
        let fourth = w.dot(&(self.k_k * w));
        // As for the sphere: sum of ((d - R) (d + R))^2.
        let left = (fourth - 2.0 * (cx * mx + cy * my) - square * b).max(0.0);
        let rms = (left / self.count).sqrt() / (2.0 * radius);
        Some(Circle { center: e1 * cx + e2 * cy, radius, rms })
    }
}
