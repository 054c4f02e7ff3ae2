//! An independent ray caster: every ray against every item of a scene, through parry.
#![allow(dead_code)] // each user takes its part

use orchard_camera::{Geometry, Item, Scene, blade};
use orchard_geometry::{Intrinsics, Pose, Shape, Vec3, inverse_transform, transform};
use parry3d_f64::bounding_volume::BoundingVolume;
use parry3d_f64::math::Vector;
use parry3d_f64::query::Ray;
use parry3d_f64::shape::{self, TriMesh};
use parry3d_f64::utils::Array2;

/// Largest range, in lengths of the ray's direction.
const FAR: f64 = 1e3;
/// Added to the radius of a sphere around an item, so that rounding does not make the sphere too small \[m\].
const MARGIN: f64 = 1e-6;

/// The items of a scene as parry's shapes.
pub struct RayCaster {
    items: Vec<Cast>,
    spheres: Vec<Around>,
}

/// Sphere around all shapes of an item, in world axes: most rays pass it by. Bare numbers, since tests are not optimised and this is nearly all that
/// they compute.
struct Around {
    p_world_middle: [f64; 3],
    /// Square of the radius with the margin \[m²\].
    radius_squared: f64,
}

/// A ray in bare numbers, and the square of its direction's length.
struct Line {
    p_world: [f64; 3],
    d_world: [f64; 3],
    d_squared: f64,
}

/// One item: the nearest of its shapes counts.
struct Cast {
    x_world_item: Pose,
    shapes: Vec<Box<dyn shape::Shape>>,
    /// True if parry's axes are turned, (x, y, z) for our (y, z, x): its y is up.
    is_turned: bool,
}

impl RayCaster {
    pub fn new(scene: &Scene) -> Self {
        let (items, spheres) = scene.items.iter().map(Cast::new).unzip();
        Self { items, spheres }
    }

    /// Range parameter along p + t d of the nearest surface of one item.
    pub fn cast(&self, item: usize, p_world: &Vec3, d_world: &Vec3) -> Option<f64> {
        let is_near = self.spheres[item].is_near(&Line::new(p_world, d_world));
        is_near.then(|| self.items[item].nearest(p_world, d_world))?
    }

    /// Nearest surface of the scene and its item.
    pub fn nearest(&self, p_world: &Vec3, d_world: &Vec3) -> Option<(f64, usize)> {
        let line = Line::new(p_world, d_world);
        let mut nearest: Option<(f64, usize)> = None;
        for (i, sphere) in self.spheres.iter().enumerate() {
            if sphere.is_near(&line)
                && let Some(t) = self.items[i].nearest(p_world, d_world)
                && nearest.is_none_or(|(least, _)| t < least)
            {
                nearest = Some((t, i));
            }
        }
        nearest
    }

    /// Nearest surface along the ray of a pixel; the range parameter is the depth \[m\].
    pub fn at_pixel(&self, k: &Intrinsics, x_world_camera: &Pose, u: f64, v: f64) -> Option<(f64, usize)> {
        self.nearest(&x_world_camera.translation.vector, &(x_world_camera.rotation * k.ray(u, v)))
    }

    /// Depths of the nearest surfaces a ten-thousandth of a pixel to each side of a pixel: what a ray that grazes a
    /// silhouette may meet after rounding.
    pub fn beside_pixel(&self, k: &Intrinsics, x_world_camera: &Pose, u: f64, v: f64) -> [Option<f64>; 4] {
        const STEP: f64 = 1e-4;
        [(-STEP, 0.0), (STEP, 0.0), (0.0, STEP), (0.0, -STEP)]
            .map(|(du, dv)| self.at_pixel(k, x_world_camera, u + du, v + dv).map(|hit| hit.0))
    }
}

impl Line {
    fn new(p_world: &Vec3, d_world: &Vec3) -> Self {
        let [p_world, d_world] = [p_world, d_world].map(|v| [v.x, v.y, v.z]);
        Self {
            p_world,
            d_world,
            d_squared: d_world[0] * d_world[0] + d_world[1] * d_world[1] + d_world[2] * d_world[2],
        }
    }
}

impl Around {
    /// True if the line through the ray meets the sphere.
    fn is_near(&self, line: &Line) -> bool {
        let (c, p, d) = (&self.p_world_middle, &line.p_world, &line.d_world);
        let (x, y, z) = (c[0] - p[0], c[1] - p[1], c[2] - p[2]);
        let t = (x * d[0] + y * d[1] + z * d[2]) / line.d_squared;
        let (x, y, z) = (x - t * d[0], y - t * d[1], z - t * d[2]);
        x * x + y * y + z * z <= self.radius_squared
    }
}

impl Cast {
    fn new(item: &Item) -> (Self, Around) {
        let is_turned = matches!(item.geometry, Geometry::Shape(Shape::HeightField(_)));
        let shapes = shapes(&item.geometry);
        let spheres = shapes.iter().map(|shape| shape.compute_local_bounding_sphere());
        let around = spheres.reduce(|all, one| all.merged(&one)).expect("an item has a shape");
        let Vector { x, y, z } = around.center;
        let middle = if is_turned { Vec3::new(z, x, y) } else { Vec3::new(x, y, z) };
        let p_world_middle = transform(&item.x_world_item, &middle);
        let radius = around.radius + MARGIN;
        let p_world_middle = [p_world_middle.x, p_world_middle.y, p_world_middle.z];
        let sphere = Around { p_world_middle, radius_squared: radius * radius };
        (Self { x_world_item: item.x_world_item, shapes, is_turned }, sphere)
    }

    fn nearest(&self, p_world: &Vec3, d_world: &Vec3) -> Option<f64> {
        let p = inverse_transform(&self.x_world_item, p_world);
        let d = self.x_world_item.rotation.inverse() * d_world;
        let ray = if self.is_turned {
            Ray::new(Vector::new(p.y, p.z, p.x), Vector::new(d.y, d.z, d.x))
        } else {
            Ray::new(vector(&p), vector(&d))
        };
        let hits = self.shapes.iter().filter_map(|shape| shape.cast_local_ray(&ray, FAR, false));
        hits.min_by(f64::total_cmp)
    }
}

/// Hulls and blades triangle by triangle, terrain as a mesh: parry's own traversals of hulls and height fields miss hits.
fn shapes(geometry: &Geometry) -> Vec<Box<dyn shape::Shape>> {
    let one = |shape: Box<dyn shape::Shape>| vec![shape];
    match geometry {
        &Geometry::Shape(Shape::Sphere { radius }) => one(Box::new(shape::Ball::new(radius))),
        &Geometry::Shape(Shape::Capsule { radius, length }) => {
            one(Box::new(shape::Capsule::new(Vector::ZERO, Vector::new(0.0, 0.0, length), radius)))
        }
        Geometry::Shape(Shape::Box { half }) => one(Box::new(shape::Cuboid::new(vector(half)))),
        Geometry::Shape(Shape::HalfSpace) => one(Box::new(shape::HalfSpace::new(Vector::new(0.0, 0.0, 1.0)))),
        Geometry::Shape(Shape::ConvexHull(hull)) => {
            let (vertices, faces) = hull.parry().to_trimesh();
            triangles(&vertices, faces.iter().map(|face| face.map(|k| k as usize)))
        }
        Geometry::Shape(Shape::HeightField(field)) => {
            let [dx, dy] = field.spacing();
            let size = [dx * (field.columns() - 1) as f64, dy * (field.rows() - 1) as f64];
            let heights = Array2::new(field.columns(), field.rows(), field.heights().to_vec());
            let same = shape::HeightField::new(heights, Vector::new(size[1], 1.0, size[0]));
            let (vertices, faces) = same.to_trimesh();
            one(Box::new(TriMesh::new(vertices, faces).expect("terrain has triangles")))
        }
        Geometry::Blade { mesh, length, width } => {
            let vertices = mesh.vertices(*length, *width).map(|v| vector(&v));
            triangles(&vertices, blade::triangles().into_iter())
        }
    }
}

fn triangles(vertices: &[Vector], faces: impl Iterator<Item = [usize; 3]>) -> Vec<Box<dyn shape::Shape>> {
    let triangle = |[a, b, c]: [usize; 3]| shape::Triangle::new(vertices[a], vertices[b], vertices[c]);
    faces.map(|face| Box::new(triangle(face)) as Box<dyn shape::Shape>).collect()
}

fn vector(v: &Vec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}
