//! Image rectangles that cover a primitive, from the slopes x/z and y/z that it spans.

use orchard_geometry::{Intrinsics, Vec3, math};
use std::f64::consts::{FRAC_PI_2, PI};

/// Depth at which edges that pass behind the camera are cut before projection \[m\]: below any depth of use, and the slopes
/// beyond it are clamped to the image.
const CUT: f64 = 1e-9;
/// Widening of a rectangle \[px\], so that rounding of the bounds never loses a pixel that the exact test hits.
const SLACK: f64 = 1e-6;

/// Slopes x/z and y/z that a primitive spans.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    x: Interval,
    y: Interval,
}

type Interval = (f64, f64);
const WHOLE: Interval = (f64::NEG_INFINITY, f64::INFINITY);
const EMPTY: Interval = (f64::INFINITY, f64::NEG_INFINITY);

/// Pixels, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PixelRect {
    pub(crate) u: (usize, usize),
    pub(crate) v: (usize, usize),
}

impl Bounds {
    pub(crate) const EVERYWHERE: Bounds = Bounds { x: WHOLE, y: WHOLE };

    /// Bounds of all points within `radius` of a segment.
    pub(crate) fn of_capsule(a: &Vec3, b: &Vec3, radius: f64) -> Self {
        let (x, y) = if a.z > radius && b.z > radius {
            let slopes = |k: usize| hull(ahead(a[k], a.z, radius), ahead(b[k], b.z, radius));
            (slopes(0), slopes(1))
        } else {
            (around(a, b, 0, radius), around(a, b, 1, radius))
        };
        Self { x, y }
    }

    /// Bounds of the convex hull of points, given its edges (or any set of pairs that includes them).
    pub(crate) fn of_polyhedron(points: &[Vec3], edges: &[(usize, usize)]) -> Self {
        let (mut x, mut y) = (EMPTY, EMPTY);
        let mut add = |p: &Vec3| {
            x = hull(x, (p.x / p.z, p.x / p.z));
            y = hull(y, (p.y / p.z, p.y / p.z));
        };
        for p in points.iter().filter(|p| p.z >= CUT) {
            add(p);
        }
        for &(i, j) in edges {
            let (p, q) = (&points[i], &points[j]);
            if (p.z < CUT) != (q.z < CUT) {
                let cut = p + (q - p) * ((CUT - p.z) / (q.z - p.z));
                add(&Vec3::new(cut.x, cut.y, CUT));
            }
        }
        Self { x, y }
    }

    /// Pixels whose rays lie within the slopes; `None` if there are none.
    pub(crate) fn pixels(&self, k: &Intrinsics) -> Option<PixelRect> {
        Some(PixelRect {
            u: pixel_range(self.x, k.fx, k.cx, k.width)?,
            v: pixel_range(self.y, k.fy, k.cy, k.height)?,
        })
    }
}

fn hull(a: Interval, b: Interval) -> Interval {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Slopes of the two tangents from the origin to a circle about (z, x) with z > r.
fn ahead(x: f64, z: f64, r: f64) -> Interval {
    let root = r * (x * x + z * z - r * r).sqrt();
    let q = z * z - r * r;
    ((x * z - root) / q, (x * z + root) / q)
}

/// Slopes that a capsule spans when it may reach beside or behind the camera: angles about the camera in the
/// plane of z and coordinate `k`.
fn around(a: &Vec3, b: &Vec3, k: usize, r: f64) -> Interval {
    // Only the part in front counts: cut the axis where its ball is wholly behind the camera.
    let clip = |p: &Vec3, q: &Vec3| {
        if p.z >= -r { *p } else { p + (q - p) * ((-r - p.z) / (q.z - p.z)).clamp(0.0, 1.0) }
    };
    if a.z < -r && b.z < -r {
        return EMPTY;
    }
    let angles = [clip(a, b), clip(b, a)].map(|p| {
        let distance = math::hypot(p[k], p.z);
        let mid = math::atan2(p[k], p.z);
        // The camera is inside the ball: all directions.
        let half = if distance > r { math::asin(r / distance) } else { PI };
        (mid - half, mid + half)
    });
    let (low, high) = hull(angles[0], angles[1]);
    // A convex figure that spans half a turn or more contains the camera.
    if high - low >= PI {
        return WHOLE;
    }
    let slope =
        |angle: f64| if angle.abs() < FRAC_PI_2 { math::tan(angle) } else { angle.signum() * f64::INFINITY };
    (slope(low), slope(high))
}

fn pixel_range(slopes: Interval, f: f64, c: f64, count: usize) -> Option<(usize, usize)> {
    let low = (slopes.0 * f + c - SLACK).ceil().max(0.0);
    let high = (slopes.1 * f + c + SLACK).floor().min(count as f64 - 1.0);
    (low <= high).then_some((low as usize, high as usize))
}
