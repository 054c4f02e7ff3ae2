//! Balls and capsules.

use super::{Hit, NO_SIDES, Sides, first_positive, sides};
use crate::bounds::Bounds;
use orchard_geometry::Vec3;

/// Square of the least distance of a camera from a cylinder's axis, in radii, at which tangent planes keep half of their
/// digits.
const TANGENT: f64 = 1.0 + 1e-6;

#[derive(Debug, Clone, Copy)]
pub(crate) struct Sphere {
    center: Vec3,
    radius: f64,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Capsule {
    base: Sphere,
    tip: Sphere,
    axis: Vec3,
    length: f64,
    /// base x axis
    moment: Vec3,
    /// base . axis
    base_axial: f64,
}

impl Hit for Sphere {
    #[inline]
    fn hit(&self, d: &Vec3) -> Option<f64> {
        self.crossings(d).and_then(|(near, far)| first_positive(near, far))
    }

    fn normal(&self, p: &Vec3) -> Vec3 {
        p - self.center
    }

    fn depths(&self) -> (f64, f64) {
        (self.center.z - self.radius, self.center.z + self.radius)
    }

    fn bounds(&self) -> Bounds {
        Bounds::of_capsule(&self.center, &self.center, self.radius)
    }

    fn sides(&self, _far: f64) -> Sides {
        NO_SIDES
    }
}

impl Sphere {
    /// Makes a ball about a centre.
    pub(crate) fn new(center: Vec3, radius: f64) -> Self {
        Self { center, radius }
    }

    /// Both roots of |t d - c|^2 = r^2. The discriminant is |d|^2 r^2 - |d x c|^2: no cancellation far away.
    #[inline]
    fn crossings(&self, d: &Vec3) -> Option<(f64, f64)> {
        let dd = d.norm_squared();
        let disc = dd * self.radius * self.radius - d.cross(&self.center).norm_squared();
        (disc >= 0.0).then(|| {
            let (mid, half) = (d.dot(&self.center) / dd, disc.sqrt() / dd);
            (mid - half, mid + half)
        })
    }
}

impl Capsule {
    pub(super) fn new(base: Vec3, axis: Vec3, length: f64, radius: f64) -> Self {
        Self {
            base: Sphere { center: base, radius },
            tip: Sphere { center: base + axis * length, radius },
            axis,
            length,
            moment: base.cross(&axis),
            base_axial: base.dot(&axis),
        }
    }

    /// Crossing of the capsule for a crossing `t` of its infinite cylinder: `t` if it lies within the length of the axis, else
    /// the crossing of the end ball on the same side.
    #[inline]
    fn on_capsule(&self, d: &Vec3, t: f64, axial_rate: f64, entering: bool) -> Option<f64> {
        let axial = t * axial_rate - self.base_axial;
        let ball = if axial < 0.0 {
            &self.base
        } else if axial > self.length {
            &self.tip
        } else {
            return Some(t);
        };
        ball.crossings(d).map(|(near, far)| if entering { near } else { far })
    }
}

impl Hit for Capsule {
    #[inline]
    fn hit(&self, d: &Vec3) -> Option<f64> {
        // Distance to the axis: |t d x a - base x a| = r, two vectors in the plane across the axis.
        let across = d.cross(&self.axis);
        let a = across.norm_squared();
        let radius = self.base.radius;
        let off = across.cross(&self.moment).dot(&self.axis);
        let disc = a * radius * radius - off * off;
        if disc < 0.0 {
            return None;
        }
        let axial_rate = d.dot(&self.axis);
        let (near, far) = if a > 0.0 {
            let (mid, half) = (across.dot(&self.moment) / a, disc.sqrt() / a);
            (mid - half, mid + half)
        } else if self.moment.norm_squared() <= radius * radius {
            // Along the axis, inside the infinite cylinder: always between the end balls' outer crossings.
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            return None;
        };
        let near = self.on_capsule(d, near, axial_rate, true)?;
        if near > 0.0 {
            return Some(near);
        }
        self.on_capsule(d, far, axial_rate, false).filter(|&t| t > 0.0)
    }

    fn normal(&self, p: &Vec3) -> Vec3 {
        let axial = (p.dot(&self.axis) - self.base_axial).max(0.0).min(self.length);
        p - self.base.center - self.axis * axial
    }

    fn depths(&self) -> (f64, f64) {
        let (base, tip) = (self.base.depths(), self.tip.depths());
        (base.0.min(tip.0), base.1.max(tip.1))
    }

    fn bounds(&self) -> Bounds {
        Bounds::of_capsule(&self.base.center, &self.tip.center, self.base.radius)
    }

    fn sides(&self, _far: f64) -> Sides {
        // The two planes that touch the infinite cylinder. From the camera the axis lies at q, a distance D away; a
        // plane's unit normal n is across the axis with n . q = r.
        let radius = self.base.radius;
        let distance2 = self.moment.norm_squared();
        if distance2 <= radius * radius * TANGENT {
            return NO_SIDES;
        }
        let towards = self.axis.cross(&self.moment) * radius;
        let beside = self.moment * (distance2 - radius * radius).sqrt();
        sides([towards + beside, towards - beside])
    }
}
