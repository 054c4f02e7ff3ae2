//! Boxes, planes and triangles.

use super::{Hit, NO_SIDES, Sides, first_positive, sides};
use crate::bounds::Bounds;
use orchard_geometry::{Mat3, Pose, Vec3};

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

impl Cuboid {
    pub(super) fn new(x_camera_box: &Pose, half: Vec3) -> Self {
        let center = x_camera_box.translation.vector;
        let to_local = x_camera_box.rotation.to_rotation_matrix().matrix().transpose();
        Self { to_local, origin: -(to_local * center), center, half }
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
            // For rays parallel to a slab's faces these are infinite or NaN, which `max` and `min` ignore.
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
        // Planes through the silhouette edges: between a face towards the camera and one away from it.
        let is_before = |k: usize, sign: f64| sign * self.origin[k] > self.half[k];
        let mut sides = NO_SIDES;
        let mut free = sides.iter_mut();
        for (along, i, j) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            for (si, sj) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                if is_before(i, si) == is_before(j, sj) {
                    continue;
                }
                let mut p_edge = -self.origin;
                p_edge[i] += si * self.half[i];
                p_edge[j] += sj * self.half[j];
                let n = p_edge.cross(&Vec3::ith(along, 1.0));
                if let Some(side) = free.next() {
                    // The box's centre is on the inner side.
                    *side = self.to_local.tr_mul(&n) * -n.dot(&self.origin).signum();
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

impl Plane {
    /// Makes the plane through a point.
    pub(super) fn new(p: &Vec3, normal: Vec3) -> Self {
        Self { normal, offset: normal.dot(p) }
    }
}

impl Hit for Plane {
    #[inline]
    fn hit(&self, d: &Vec3) -> Option<f64> {
        // For a ray parallel to the plane: infinite or NaN; the comparison rejects both.
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
    pub(super) fn new(vertices: [Vec3; 3]) -> Self {
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
