//! Small meshes that instances scale.
//!
//! A vertex has three vectors and a normal: under the sizes (x, y, z) of an instance it lies at `a x + b y + c z` in the instance's frame, so that one
//! mesh serves capsules of every radius and length. A normal of zero stands for the triangle's own.

use std::f64::consts::{FRAC_PI_2, TAU};

use orchard_camera::blade::{BladeMesh, triangles};
use orchard_geometry::{ConvexHull, HeightField, Vec3, math};

/// Numbers of a vertex: a, b, c, normal.
pub const MESH_FLOATS: usize = 12;

/// Sides of a round mesh, and rings from its equator to a pole.
#[derive(Debug, Clone, Copy)]
pub struct Fineness {
    sides: usize,
    rings: usize,
}

impl Fineness {
    /// For thin capsules, of which a tree has a thousand.
    pub const TWIG: Self = Self { sides: 8, rings: 2 };
    /// For apples that fill a hundred pixels.
    pub const APPLE: Self = Self { sides: 16, rings: 5 };
    /// For a sphere as large as a robot.
    pub const SPHERE: Self = Self { sides: 40, rings: 10 };
    /// For capsules and balls of few pixels.
    pub(crate) const COARSE_TWIG: Self = Self { sides: 5, rings: 1 };
    pub(crate) const COARSE_APPLE: Self = Self { sides: 8, rings: 3 };
}

/// A mesh as a list of triangles, three vertices each, [`MESH_FLOATS`] numbers a vertex.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// The numbers.
    pub floats: Vec<f32>,
    /// True for a surface that encloses nothing: both of its sides are seen.
    pub is_open: bool,
}

/// A vertex: a, b, c, normal.
type Vertex = [Vec3; 4];

impl Mesh {
    fn push(&mut self, vertices: [Vertex; 3]) {
        let numbers = vertices.iter().flatten().flat_map(|vector| vector.iter());
        self.floats.extend(numbers.map(|x| *x as f32));
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.floats.len() / (3 * MESH_FLOATS)
    }

    /// A capsule from the origin along z: sizes (radius, length, -). With length 0 it is a ball.
    pub fn capsule(Fineness { sides, rings }: Fineness) -> Self {
        let mut mesh = Self::default();
        // Latitudes of the lower half, then of the upper half, which the length lifts.
        let lower = (0..=rings).map(|k| (FRAC_PI_2 * (k as f64 / rings as f64 - 1.0), 0.0));
        let upper = (0..=rings).map(|k| (FRAC_PI_2 * k as f64 / rings as f64, 1.0));
        let circles: Vec<(f64, f64)> = lower.chain(upper).collect();
        let vertex = |(latitude, lift): (f64, f64), side: usize| -> Vertex {
            let (sin, cos) = math::sin_cos(latitude);
            let (across, along) = math::sin_cos(TAU * (side % sides) as f64 / sides as f64);
            let normal = Vec3::new(cos * along, cos * across, sin);
            [normal, Vec3::z() * lift, Vec3::zeros(), normal]
        };
        for pair in circles.windows(2) {
            for side in 0..sides {
                let [a, b] = [vertex(pair[0], side), vertex(pair[0], side + 1)];
                let [c, d] = [vertex(pair[1], side), vertex(pair[1], side + 1)];
                if pair[0].0 > -FRAC_PI_2 {
                    mesh.push([a, b, d]);
                }
                if pair[1].0 < FRAC_PI_2 {
                    mesh.push([a, d, c]);
                }
            }
        }
        mesh
    }

    /// A box about the origin: sizes are its half-extents.
    pub fn cuboid() -> Self {
        let mut mesh = Self::default();
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        for k in 0..3 {
            for sign in [-1.0, 1.0] {
                let (normal, u, v) = (axes[k] * sign, axes[(k + 1) % 3] * sign, axes[(k + 2) % 3]);
                let corner = |s: f64, t: f64| -> Vertex {
                    let p = normal + u * s + v * t;
                    [Vec3::x() * p.x, Vec3::y() * p.y, Vec3::z() * p.z, normal]
                };
                let [a, b, c, d] =
                    [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                mesh.push([a, b, c]);
                mesh.push([a, c, d]);
            }
        }
        mesh
    }

    /// A leaf blade: sizes (length, width, -).
    pub fn blade(blade: &BladeMesh) -> Self {
        let (along, across) = (blade.vertices(1.0, 0.0), blade.vertices(0.0, 1.0));
        let mut mesh = Self { is_open: true, ..Self::default() };
        for corners in triangles() {
            mesh.push(corners.map(|k| [along[k], across[k], Vec3::zeros(), Vec3::zeros()]));
        }
        mesh
    }

    /// A leaf blade of few pixels in two flat halves with the area of the ellipse: sizes (length, width, -).
    pub(crate) fn coarse_blade(blade: &BladeMesh) -> Self {
        /// Places of the corners along the blade, and their distance from the midrib over half the width.
        const ALONG: [f64; 2] = [0.25, 0.75];
        const ACROSS: f64 = TAU / 6.0;
        let farthest = |vertices: &[Vec3], way: &Vec3| -> Vec3 {
            let along = vertices.iter().max_by(|a, b| a.dot(way).total_cmp(&b.dot(way)));
            along.copied().unwrap_or_default()
        };
        let tip = farthest(&blade.vertices(1.0, 0.0), &Vec3::x());
        let mut mesh = Self { is_open: true, ..Self::default() };
        for side in [Vec3::y(), -Vec3::y()] {
            let edge = ACROSS * farthest(&blade.vertices(0.0, 1.0), &side);
            let normal = tip.cross(&edge).normalize();
            let normal = normal * normal.z.signum();
            let at =
                |along: f64, across: f64| -> Vertex { [tip * along, edge * across, Vec3::zeros(), normal] };
            let [petiole, low, high, tip] =
                [at(0.0, 0.0), at(ALONG[0], 1.0), at(ALONG[1], 1.0), at(1.0, 0.0)];
            mesh.push([petiole, low, high]);
            mesh.push([petiole, high, tip]);
        }
        mesh
    }

    /// A convex hull: sizes (scale, -, -).
    pub fn hull(hull: &ConvexHull) -> Self {
        let mut mesh = Self::default();
        for face in hull.faces() {
            let corner = |k: u32| -> Vertex {
                [hull.vertices()[k as usize], Vec3::zeros(), Vec3::zeros(), face.normal]
            };
            let around = hull.boundary(face);
            for pair in around.windows(2).skip(1) {
                mesh.push([corner(around[0]), corner(pair[0]), corner(pair[1])]);
            }
        }
        mesh
    }

    /// The surface of terrain: sizes (scale, -, -).
    pub fn terrain(field: &HeightField) -> Self {
        let mut mesh = Self { is_open: true, ..Self::default() };
        for triangle in field.triangles(field.cells()) {
            mesh.push(triangle.map(|p| [p, Vec3::zeros(), Vec3::zeros(), Vec3::zeros()]));
        }
        mesh
    }

    /// A cone with its base about the origin and its tip on z: sizes (radius, length, -).
    pub fn cone(sides: usize) -> Self {
        let mut mesh = Self::default();
        let rim = |side: usize| {
            let (sin, cos) = math::sin_cos(TAU * (side % sides) as f64 / sides as f64);
            Vec3::new(cos, sin, 0.0)
        };
        for side in 0..sides {
            let (p, q) = (rim(side), rim(side + 1));
            let flat = |a: Vec3, b: Vec3| -> Vertex { [a, b, Vec3::zeros(), Vec3::zeros()] };
            let (zero, tip) = (Vec3::zeros(), Vec3::z());
            mesh.push([flat(p, zero), flat(q, zero), flat(zero, tip)]);
            mesh.push([flat(q, zero), flat(p, zero), flat(zero, zero)]);
        }
        mesh
    }

    /// A level square about the origin: sizes (half its side, -, -).
    pub fn square() -> Self {
        let corner =
            |x: f64, y: f64| -> Vertex { [Vec3::new(x, y, 0.0), Vec3::zeros(), Vec3::zeros(), Vec3::z()] };
        let mut mesh = Self { is_open: true, ..Self::default() };
        mesh.push([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0)]);
        mesh.push([corner(-1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
        mesh
    }
}

#[cfg(test)]
#[path = "mesh_tests.rs"]
mod tests;
