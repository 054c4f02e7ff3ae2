//! Outline of a sphere in a depth image: where its surface ends, seen from the middle.

use crate::cloud::Cloud;
use crate::sphere::Sphere;
use nalgebra::{Matrix3, Vector3};
use orchard_geometry::math;
use std::sync::OnceLock;

/// Number of directions in which the end of a surface is sought.
pub(crate) const DIRECTIONS: usize = 32;
/// Distance from the middle at which the search ends, as a multiple of the sphere's radius in the image.
const REACH: f64 = 1.8;
/// A surface ends where depth lies this far behind the centre, as a share of the radius: the rim of a ball is as deep as its centre.
const BEHIND: f64 = 0.2;
/// Ends farther than this from the fitted circle, as a share of its radius, are left out.
const OUTLIER: f64 = 0.2;
/// Least number of ends that determine a circle well enough to use it.
const LEAST_ENDS: usize = 8;

/// The outline of a sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Outline {
    /// Share of the directions in which the surface ends at a gap or hole near the circle.
    pub(crate) ended: f64,
    /// Share of the directions in which something in front hides the end.
    pub(crate) hidden: f64,
    /// The circle; `None` if too few ends were found.
    pub(crate) circle: Option<Circle>,
}

/// A circle in the image \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Circle {
    pub(crate) center: (f64, f64),
    pub(crate) radius: f64,
    /// RMS distance of the ends from it.
    pub(crate) rms: f64,
}

/// End of a surface in one direction.
enum End {
    At(f64, f64),
    Hidden,
    Never,
}

/// Finds the outline of a sphere. A pixel at least `hides` \[m\] in front of the sphere hides what is behind it.
pub(crate) fn trace(cloud: &Cloud, sphere: &Sphere, hides: f64) -> Outline {
    let center = cloud.intrinsics.project(&sphere.center).filter(|(u, v)| u.is_finite() && v.is_finite());
    let Some(center) = center else {
        return Outline { ended: 0.0, hidden: 0.0, circle: None };
    };
    let radius_px = sphere.radius * cloud.focal / sphere.center.z;
    let (mut ends, mut hidden) = (Vec::with_capacity(DIRECTIONS), 0);
    for direction in directions() {
        match end(cloud, sphere, center, *direction, REACH * radius_px, hides) {
            End::At(u, v) => ends.push((u, v)),
            End::Hidden => hidden += 1,
            End::Never => {}
        }
    }
    let share = |n: usize| n as f64 / DIRECTIONS as f64;
    let mut circle = Circle::fit(&ends);
    for _ in 0..3 {
        if let Some(c) = circle {
            let near = |&(u, v): &(f64, f64)| {
                (distance(u - c.center.0, v - c.center.1) - c.radius).abs() <= OUTLIER * c.radius
            };
            let before = ends.len();
            ends.retain(near);
            if ends.len() == before {
                break;
            }
            circle = Circle::fit(&ends);
        }
    }
    Outline {
        ended: share(ends.len()),
        hidden: share(hidden),
        circle: circle.filter(|_| ends.len() >= LEAST_ENDS),
    }
}

/// Directions in which the end of a surface is sought.
fn directions() -> &'static [(f64, f64); DIRECTIONS] {
    static ALL: OnceLock<[(f64, f64); DIRECTIONS]> = OnceLock::new();
    ALL.get_or_init(|| {
        std::array::from_fn(|k| {
            let (sin, cos) = math::sin_cos(std::f64::consts::TAU * k as f64 / DIRECTIONS as f64);
            (cos, sin)
        })
    })
}

fn end(cloud: &Cloud, sphere: &Sphere, from: (f64, f64), step: (f64, f64), reach: f64, hides: f64) -> End {
    let rim = sphere.center.z + BEHIND * sphere.radius;
    let front = sphere.center.z - sphere.radius - hides;
    let mut last: Option<(f64, f64)> = None;
    let mut t = 0.0;
    while t <= reach {
        let (u, v) = (from.0 + t * step.0, from.1 + t * step.1);
        let (column, row) = (u + 0.5, v + 0.5);
        if column < 0.0 || row < 0.0 || column >= cloud.width as f64 || row >= cloud.height as f64 {
            return End::Never;
        }
        let z = cloud.z(row as usize * cloud.width + column as usize);
        if z > 0.0 && z < front {
            return End::Hidden;
        }
        if z <= 0.0 || z > rim {
            // A single hole may lie within the surface: the end is where the surface was last seen.
            if let Some((t_last, z_last)) = last {
                if z <= 0.0 {
                    if t - t_last < 3.0 {
                        t += 1.0;
                        continue;
                    }
                    return End::At(from.0 + (t_last + 0.5) * step.0, from.1 + (t_last + 0.5) * step.1);
                }
                let share = ((rim - z_last) / (z - z_last)).clamp(0.0, 1.0);
                let t = t_last + share * (t - t_last);
                return End::At(from.0 + t * step.0, from.1 + t * step.1);
            }
        } else {
            last = Some((t, z));
        }
        t += 1.0;
    }
    End::Never
}

fn distance(u: f64, v: f64) -> f64 {
    (u * u + v * v).sqrt()
}

impl Circle {
    /// Fits a circle by linear least squares on 2 q.m + b = |q|^2, as for the sphere.
    fn fit(points: &[(f64, f64)]) -> Option<Self> {
        if points.len() < 4 {
            return None;
        }
        let n = points.len() as f64;
        let (mu, mv) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
        let (mut a, mut b) = (Matrix3::zeros(), Vector3::zeros());
        for (u, v) in points {
            let row = Vector3::new(2.0 * (u - mu), 2.0 * (v - mv), 1.0);
            let square = (u - mu) * (u - mu) + (v - mv) * (v - mv);
            a += row * row.transpose();
            b += row * square;
        }
        let x = a.cholesky()?.solve(&b);
        let radius = (x[2] + x[0] * x[0] + x[1] * x[1]).sqrt();
        let center = (x[0] + mu, x[1] + mv);
        let square = |p: &(f64, f64)| {
            let e = distance(p.0 - center.0, p.1 - center.1) - radius;
            e * e
        };
        let rms = (points.iter().map(square).sum::<f64>() / n).sqrt();
        (radius.is_finite() && rms.is_finite()).then_some(Self { center, radius, rms })
    }
}
