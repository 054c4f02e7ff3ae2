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
}

/// One item: the nearest of its shapes counts.
struct Cast {
    x_world_item: Pose,
    shapes: Vec<Box<dyn shape::Shape>>,
    /// Sphere around all shapes, in world axes: most rays pass it by.
    p_world_middle: Vec3,
    radius: f64,
    /// True if parry's axes are turned, (x, y, z) for our (y, z, x): its y is up.
    is_turned: bool,
}

impl RayCaster {
    pub fn new(scene: &Scene) -> Self {
        Self { items: scene.items.iter().map(Cast::new).collect() }
    }

    /// Range parameter along p + t d of the nearest surface of one item.
    pub fn cast(&self, item: usize, p_world: &Vec3, d_world: &Vec3) -> Option<f64> {
        self.items[item].nearest(p_world, d_world)
    }

    /// Nearest surface of the scene and its item.
    pub fn nearest(&self, p_world: &Vec3, d_world: &Vec3) -> Option<(f64, usize)> {
        let hits = self.items.iter().enumerate();
        hits.filter_map(|(i, item)| Some((item.nearest(p_world, d_world)?, i)))
            .min_by(|a, b| a.0.total_cmp(&b.0))
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

impl Cast {
    fn new(item: &Item) -> Self {
        let is_turned = matches!(item.geometry, Geometry::Shape(Shape::HeightField(_)));
        let shapes = shapes(&item.geometry);
        let spheres = shapes.iter().map(|shape| shape.compute_local_bounding_sphere());
        let around = spheres.reduce(|all, one| all.merged(&one)).expect("an item has a shape");
        let Vector { x, y, z } = around.center;
        let middle = if is_turned { Vec3::new(z, x, y) } else { Vec3::new(x, y, z) };
        let p_world_middle = transform(&item.x_world_item, &middle);
        Self { x_world_item: item.x_world_item, shapes, p_world_middle, radius: around.radius, is_turned }
    }

    fn nearest(&self, p_world: &Vec3, d_world: &Vec3) -> Option<f64> {
        let to_middle = self.p_world_middle - p_world;
        let from_line = to_middle - d_world * (to_middle.dot(d_world) / d_world.norm_squared());
        if from_line.norm() > self.radius + MARGIN {
            return None;
        }
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
