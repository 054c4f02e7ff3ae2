//! The best cylinder through points, for the comparison with the sphere.

use crate::sphere::root_mean_square;
use orchard_geometry::{Vec3, math};

/// Directions of the coarse search, spread over half the sphere (about 20 degrees apart).
const DIRECTIONS: usize = 48;
/// First step of the fine search [rad]: the spacing of the coarse directions.
const FIRST_STEP: f64 = 0.3;
/// Halvings of the fine search: to FIRST_STEP / 64, 0.3 degrees.
const HALVINGS: usize = 6;
/// Points whose second moments have a smaller determinant, relative to their trace squared, are a line.
const LINE: f64 = 1e-12;

/// Least RMS radial residual [m] of a cylinder of free axis and radius through the points; infinite if none
/// can be fitted. For each axis direction the circle across it is linear least squares, as for the sphere; the
/// direction is searched coarse to fine.
pub(crate) fn best_rms(points: &[Vec3]) -> f64 {
    let mean = points.iter().sum::<Vec3>() / points.len().max(1) as f64;
    let centred: Vec<Vec3> = points.iter().map(|p| p - mean).collect();
    let mut best = (f64::INFINITY, Vec3::z());
    let consider = |best: &mut (f64, Vec3), axis: Vec3| {
        let rms = circle_rms(&centred, &axis);
        if rms < best.0 {
            *best = (rms, axis);
        }
    };
    for i in 0..DIRECTIONS {
        consider(&mut best, half_sphere_direction(i, DIRECTIONS));
    }
    let mut step = FIRST_STEP;
    for _ in 0..HALVINGS {
        let (e1, e2) = across(&best.1);
        for (a, b) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            let axis = best.1 + (e1 * a + e2 * b) * step;
            consider(&mut best, axis.normalize());
        }
        step *= 0.5;
    }
    best.0
}

/// Point `i` of `n` of a Fibonacci lattice over the half sphere z > 0.
fn half_sphere_direction(i: usize, n: usize) -> Vec3 {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let z = (i as f64 + 0.5) / n as f64;
    let (sin, cos) = math::sin_cos(golden_angle * i as f64);
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

/// Two unit vectors across a unit vector.
fn across(axis: &Vec3) -> (Vec3, Vec3) {
    let reference = if axis.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let e1 = axis.cross(&reference).normalize();
    (e1, axis.cross(&e1))
}

/// RMS radial residual of the least-squares circle of points (about their mean) seen along an axis.
fn circle_rms(centred: &[Vec3], axis: &Vec3) -> f64 {
    let (e1, e2) = across(axis);
    let flat = centred.iter().map(|q| (q.dot(&e1), q.dot(&e2)));
    let [mut sxx, mut sxy, mut syy, mut mx, mut my, mut square] = [0.0; 6];
    for (x, y) in flat.clone() {
        let rr = x * x + y * y;
        sxx += x * x;
        sxy += x * y;
        syy += y * y;
        mx += x * rr;
        my += y * rr;
        square += rr;
    }
    let det = sxx * syy - sxy * sxy;
    let flatness = det / (square * square);
    // Seen edge-on the points are a line: no circle.
    if flatness.is_nan() || flatness < LINE {
        return f64::INFINITY;
    }
    let (cx, cy) = (0.5 * (syy * mx - sxy * my) / det, 0.5 * (sxx * my - sxy * mx) / det);
    let radius = (square / centred.len() as f64 + cx * cx + cy * cy).sqrt();
    root_mean_square(flat.map(|(x, y)| ((x - cx) * (x - cx) + (y - cy) * (y - cy)).sqrt() - radius))
}
