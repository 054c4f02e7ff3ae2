//! Random rotations, and scenes of shapes of every kind. The tests of images on a graphics device include this file.

use orchard_camera::{Geometry, Label, Scene, blade::BladeMesh};
use orchard_geometry::{ConvexHull, HeightField, Pose, Rotation, Shape, Vec3, rotation_from_z};
use orchard_spec::{Spec, Stream};
use std::sync::Arc;

use super::direction::direction;

/// A uniformly distributed rotation.
pub fn rotation(rng: &mut Stream) -> Rotation {
    let twist = rng.uniform(-3.2, 3.2);
    rotation_from_z(&direction(rng)) * Rotation::from_axis_angle(&Vec3::z_axis(), twist)
}

/// Random shapes within 1.5 m of the origin; most reach across it.
pub fn shapes(rng: &mut Stream, count: u32) -> Scene {
    let mesh = Arc::new(BladeMesh::from_spec(&Spec::paper().foliage));
    let mut scene = Scene::default();
    for i in 0..count {
        let size = rng.uniform(0.02, 0.6);
        let geometry = match rng.integer(0, 6) {
            0 => Geometry::Shape(Shape::Sphere { radius: size }),
            1 => Geometry::Shape(Shape::Capsule { radius: 0.3 * size, length: rng.uniform(0.0, 2.0) }),
            2 => Geometry::Shape(Shape::Box { half: Vec3::from_fn(|_, _| rng.uniform(0.01, 0.5)) }),
            3 => Geometry::Blade { mesh: mesh.clone(), length: 2.0 * size, width: size },
            4 => Geometry::Shape(Shape::HalfSpace),
            5 => {
                let cloud: Vec<Vec3> = (0..12).map(|_| direction(rng) * size).collect();
                Geometry::Shape(Shape::ConvexHull(Arc::new(ConvexHull::new(&cloud).unwrap())))
            }
            _ => {
                let heights = (0..30).map(|_| rng.uniform(-0.1, 0.1)).collect();
                let field = HeightField::new(5, 6, [0.3 * size, 0.4 * size], heights).unwrap();
                Geometry::Shape(Shape::HeightField(Arc::new(field)))
            }
        };
        let p = direction(rng) * rng.uniform(0.0, 1.5);
        scene.push(geometry, Pose::from_parts(p.into(), rotation(rng)), Label::Wood, i);
    }
    scene
}
