//! Ray-primitive intersections in the camera frame: the ray of a pixel is t (x, y, 1), so t is the depth.
//!
//! A hit is the nearest crossing of a surface in front of the camera; from inside a solid it is the exit point.

mod flat;
mod round;

use crate::bounds::Bounds;
use crate::solid::{self, Solid};
use crate::{Item, blade};
use flat::{Cuboid, Plane, Triangle};
use orchard_geometry::{Pose, Vec3};
use round::Capsule;
pub(crate) use round::Sphere;

/// A shape in the camera frame.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Primitive {
    Sphere(Sphere),
    Capsule(Capsule),
    Box(Cuboid),
    Plane(Plane),
    Triangle(Triangle),
}

/// Normals of planes through the camera, at most the six silhouette edges of a box; unused entries are zero.
pub(crate) type Sides = [Vec3; 6];

/// Value of [`Sides`] without planes.
pub(crate) const NO_SIDES: Sides = [Vec3::new(0.0, 0.0, 0.0); 6];

fn sides<const N: usize>(normals: [Vec3; N]) -> Sides {
    let mut sides = NO_SIDES;
    sides[..N].copy_from_slice(&normals);
    sides
}

/// Intersection of rays with a shape.
pub(crate) trait Hit {
    /// Depth at which the ray t `d` (`d.z` = 1) meets the surface first, t > 0.
    fn hit(&self, d: &Vec3) -> Option<f64>;
    /// A normal of the surface at a point on it, camera frame, not normalised.
    fn normal(&self, p: &Vec3) -> Vec3;
    /// Least and largest z \[m\].
    fn depths(&self) -> (f64, f64);
    /// Slopes that the primitive can cover.
    fn bounds(&self) -> Bounds;
    /// Planes through the camera that enclose the primitive: a ray d that hits within depth `far` has n . d >= 0. Not normalised.
    fn sides(&self, far: f64) -> Sides;
}

/// Calls `f` with every primitive of an item; of terrain, which may be large, only with those that can meet the convex
/// hull of the points `within` (camera frame; no points: everywhere).
pub(crate) fn for_each_primitive(
    item: &Item,
    x_camera_world: &Pose,
    within: &[Vec3],
    mut f: impl FnMut(&Primitive),
) {
    solid::of_item(item, x_camera_world, within, |solid| match solid {
        Solid::Ball { p_camera, radius } => f(&Primitive::Sphere(Sphere::new(p_camera, radius))),
        Solid::Capsule { p_camera, axis, length, radius } => {
            f(&Primitive::Capsule(Capsule::new(p_camera, axis, length, radius)));
        }
        Solid::Box { x_camera_box, half } => f(&Primitive::Box(Cuboid::new(&x_camera_box, half))),
        Solid::Plane { p_camera, normal } => f(&Primitive::Plane(Plane::new(&p_camera, normal))),
        Solid::Triangle(corners) => f(&Primitive::Triangle(Triangle::new(corners))),
        Solid::Blade { x_camera_blade: x, mesh, length, width } => {
            let (r, p) = (x.rotation.to_rotation_matrix(), x.translation.vector);
            let v = mesh.vertices(length, width).map(|v| r * v + p);
            const FACES: [[usize; 3]; blade::TRIANGLES] = blade::triangles();
            for [a, b, c] in FACES {
                f(&Primitive::Triangle(Triangle::new([v[a], v[b], v[c]])));
            }
        }
    });
}

impl Primitive {
    /// Depth and normal (not normalised) where a ray meets the primitive.
    pub(crate) fn hit_with_normal(&self, d: &Vec3) -> Option<(f64, Vec3)> {
        fn of(hit: &impl Hit, d: &Vec3) -> Option<(f64, Vec3)> {
            hit.hit(d).map(|t| (t, hit.normal(&(d * t))))
        }
        match self {
            Primitive::Sphere(p) => of(p, d),
            Primitive::Capsule(p) => of(p, d),
            Primitive::Box(p) => of(p, d),
            Primitive::Plane(p) => of(p, d),
            Primitive::Triangle(p) => of(p, d),
        }
    }
}

#[inline]
fn first_positive(near: f64, far: f64) -> Option<f64> {
    if near > 0.0 { Some(near) } else { (far > 0.0).then_some(far) }
}
