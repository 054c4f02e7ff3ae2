//! Ray-primitive intersections in the camera frame: the ray of a pixel is t (x, y, 1), so t is the depth.
//!
//! A hit is the nearest crossing of a surface in front of the camera; from inside a solid that is the way out.

use crate::bounds::Bounds;
use crate::{Geometry, Item, blade};
use orchard_geometry::{Aabb, Mat3, Pose, Shape, Vec3, inverse_transform, transform};

/// A form that a ray can meet, in the camera frame.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Primitive {
    Sphere(Sphere),
    Capsule(Capsule),
    Box(Cuboid),
    Plane(Plane),
    Triangle(Triangle),
}

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

#[derive(Debug, Clone, Copy)]
pub(crate) struct Cuboid {
    /// Rotation from the camera frame to the box frame.
    to_local: Mat3,
    /// The camera in the box frame.
    origin: Vec3,
    center: Vec3,
    half: Vec3,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    normal: Vec3,
    offset: f64,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Triangle {
    vertices: [Vec3; 3],
    /// Cross products of the vertex pairs opposite to each vertex: normals of the planes through the camera
    /// and an edge (homogeneous edge functions, Olano and Greer 1997: right for any vertex behind the camera).
    edges: [Vec3; 3],
    /// v0 . (v1 x v2)
    det: f64,
}

/// Normals of planes through the camera, at most as many as a box has edges against its background; zeros where there are fewer.
pub(crate) type Sides = [Vec3; 6];

/// Of what has none.
pub(crate) const NO_SIDES: Sides = [Vec3::new(0.0, 0.0, 0.0); 6];

fn sides<const N: usize>(normals: [Vec3; N]) -> Sides {
    let mut sides = NO_SIDES;
    sides[..N].copy_from_slice(&normals);
    sides
}

/// Square of the least distance of a camera from a cylinder's axis, in radii, from which tangent planes are
/// well conditioned: nearer by they lose more than half of their digits.
const TANGENT: f64 = 1.0 + 1e-6;

/// What a ray can meet.
pub(crate) trait Hit {
    /// Depth at which the ray t `d` (`d.z` = 1) meets the surface first, t > 0.
    fn hit(&self, d: &Vec3) -> Option<f64>;
    /// A normal of the surface at a point on it, camera frame, not normalised.
    fn normal(&self, p: &Vec3) -> Vec3;
    /// Least and largest z [m].
    fn depths(&self) -> (f64, f64);
    /// The slopes that the primitive can cover.
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
    let x = x_camera_world * item.x_world_item;
    let p = x.translation.vector;
    match &item.geometry {
        &Geometry::Shape(Shape::Sphere { radius }) => f(&Primitive::Sphere(Sphere::new(&x, radius))),
        &Geometry::Shape(Shape::Capsule { radius, length }) => {
            f(&Primitive::Capsule(Capsule::new(p, x.rotation * Vec3::z(), length, radius)));
        }
        &Geometry::Shape(Shape::Box { half }) => {
            let to_local = x.rotation.to_rotation_matrix().matrix().transpose();
            f(&Primitive::Box(Cuboid { to_local, origin: -(to_local * p), center: p, half }));
        }
        Geometry::Shape(Shape::HalfSpace) => {
            let normal = x.rotation * Vec3::z();
            f(&Primitive::Plane(Plane { normal, offset: normal.dot(&p) }));
        }
        Geometry::Shape(Shape::ConvexHull(hull)) => {
            let v: Vec<Vec3> = hull.vertices().iter().map(|v| transform(&x, v)).collect();
            for face in hull.faces() {
                // A fan about the first corner.
                if let [first, around @ ..] = hull.boundary(face) {
                    for ends in around.windows(2) {
                        let corners = [*first, ends[0], ends[1]].map(|index| v[index as usize]);
                        f(&Primitive::Triangle(Triangle::new(corners)));
                    }
                }
            }
        }
        Geometry::Shape(Shape::HeightField(field)) => {
            let points = within.iter().map(|p| inverse_transform(&x, p)).map(|p| Aabb { min: p, max: p });
            let around = points.reduce(|a, b| a.union(&b));
            let cells = match &around {
                None => Some(field.cells()),
                Some(around) => field.cells_under(around).filter(|_| field.bounds().overlaps(around)),
            };
            for corners in cells.into_iter().flat_map(|cells| field.triangles(cells)) {
                f(&Primitive::Triangle(Triangle::new(corners.map(|v| transform(&x, &v)))));
            }
        }
        &Geometry::Blade { length, width } => {
            let r = x.rotation.to_rotation_matrix();
            let v = blade::vertices(length, width).map(|v| r * v + p);
            const FACES: [[usize; 3]; blade::TRIANGLES] = blade::triangles();
            for [a, b, c] in FACES {
                f(&Primitive::Triangle(Triangle::new([v[a], v[b], v[c]])));
            }
        }
    }
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
    /// A ball about the origin of a frame.
    pub(crate) fn new(x_camera_ball: &Pose, radius: f64) -> Self {
        Self { center: x_camera_ball.translation.vector, radius }
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
    fn new(base: Vec3, axis: Vec3, length: f64, radius: f64) -> Self {
        Self {
            base: Sphere { center: base, radius },
            tip: Sphere { center: base + axis * length, radius },
            axis,
            length,
            moment: base.cross(&axis),
            base_axial: base.dot(&axis),
        }
    }

    /// The crossing of the capsule that goes with a crossing `t` of its infinite cylinder: that one if it lies
    /// along the axis, else the same side of the end ball beyond which it lies.
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

impl Hit for Cuboid {
    #[inline]
    fn hit(&self, d: &Vec3) -> Option<f64> {
        let d = self.to_local * d;
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut beside = false;
        for k in 0..3 {
            let (mid, half) = (-self.origin[k] / d[k], (self.half[k] / d[k]).abs());
            // Along a slab's faces these are infinite or not a number, which `max` and `min` pass over.
            near = near.max(mid - half);
            far = far.min(mid + half);
            beside |= d[k] == 0.0 && self.origin[k].abs() > self.half[k];
        }
        if beside {
            return None;
        }
        if near > far { None } else { first_positive(near, far) }
    }

    fn normal(&self, p: &Vec3) -> Vec3 {
        let local = (self.to_local * p + self.origin).component_div(&self.half);
        let k = local.iamax();
        self.to_local.row(k).transpose() * local[k].signum()
    }

    fn depths(&self) -> (f64, f64) {
        let half = self.to_local.column(2).abs().dot(&self.half);
        (self.center.z - half, self.center.z + half)
    }

    fn sides(&self, _far: f64) -> Sides {
        // Planes through the edges between a face that the camera is before and one that it is behind.
        let is_before = |k: usize, sign: f64| sign * self.origin[k] > self.half[k];
        let mut sides = NO_SIDES;
        let mut count = 0;
        for along in 0..3 {
            let (i, j) = ((along + 1) % 3, (along + 2) % 3);
            for (si, sj) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                if is_before(i, si) != is_before(j, sj) {
                    let mut p_edge = -self.origin;
                    p_edge[i] += si * self.half[i];
                    p_edge[j] += sj * self.half[j];
                    let mut axis = Vec3::zeros();
                    axis[along] = 1.0;
                    let n = p_edge.cross(&axis);
                    // The centre is on the inner side.
                    sides[count] = self.to_local.tr_mul(&n) * -n.dot(&self.origin).signum();
                    count += 1;
                }
            }
        }
        sides
    }

    fn bounds(&self) -> Bounds {
        let axes = self.to_local.transpose();
        let corner = |i: usize| {
            let sign = |bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
            self.center + axes * Vec3::new(sign(1), sign(2), sign(4)).component_mul(&self.half)
        };
        let corners: [Vec3; 8] = std::array::from_fn(corner);
        const EDGES: [(usize, usize); 12] =
            [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)];
        Bounds::of_polyhedron(&corners, &EDGES)
    }
}

impl Hit for Plane {
    #[inline]
    fn hit(&self, d: &Vec3) -> Option<f64> {
        // Parallel to the plane: infinite or not a number, both refused by the comparison.
        let t = self.offset / self.normal.dot(d);
        (t > 0.0 && t < f64::INFINITY).then_some(t)
    }

    fn normal(&self, _p: &Vec3) -> Vec3 {
        self.normal
    }

    fn depths(&self) -> (f64, f64) {
        (0.0, f64::INFINITY)
    }

    fn bounds(&self) -> Bounds {
        Bounds::EVERYWHERE
    }

    fn sides(&self, far: f64) -> Sides {
        // Depth offset / (n . d): positive on one side of the horizon, and below `far` a step away from it.
        let towards = self.normal * self.offset.signum();
        let horizon = Vec3::z() * (self.offset.abs() / far);
        sides([towards - horizon])
    }
}

impl Triangle {
    fn new(vertices: [Vec3; 3]) -> Self {
        let [a, b, c] = vertices;
        let edges = [b.cross(&c), c.cross(&a), a.cross(&b)];
        Self { vertices, edges, det: a.dot(&edges[0]) }
    }
}

impl Hit for Triangle {
    #[inline]
    fn hit(&self, d: &Vec3) -> Option<f64> {
        // t d = sum of w_i v_i with w_i = t (d . e_i) / det: inside where no w_i is negative.
        let [w0, w1, w2] = [d.dot(&self.edges[0]), d.dot(&self.edges[1]), d.dot(&self.edges[2])];
        let inside = if self.det > 0.0 {
            w0 >= 0.0 && w1 >= 0.0 && w2 >= 0.0
        } else {
            self.det < 0.0 && w0 <= 0.0 && w1 <= 0.0 && w2 <= 0.0
        };
        let sum = w0 + w1 + w2;
        (inside && sum != 0.0).then(|| self.det / sum)
    }

    fn normal(&self, _p: &Vec3) -> Vec3 {
        let [a, b, c] = self.vertices;
        (b - a).cross(&(c - a))
    }

    fn depths(&self) -> (f64, f64) {
        let [a, b, c] = self.vertices.map(|v| v.z);
        (a.min(b).min(c), a.max(b).max(c))
    }

    fn sides(&self, _far: f64) -> Sides {
        sides(self.edges.map(|n| n * self.det.signum()))
    }

    fn bounds(&self) -> Bounds {
        Bounds::of_polyhedron(&self.vertices, &[(0, 1), (1, 2), (2, 0)])
    }
}

#[inline]
fn first_positive(near: f64, far: f64) -> Option<f64> {
    if near > 0.0 { Some(near) } else { (far > 0.0).then_some(far) }
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
