//! The renderer against an independent ray caster: every ray against every item, through parry.

mod common;

use common::direction;
use orchard_camera::{Frame, Geometry, Item, Label, NO_INSTANCE, Scene, blade, picture::look_at, render};
use orchard_geometry::{
    ConvexHull, HeightField, Intrinsics, Pose, Rotation, Shape, Vec3, inverse_transform, rotation_from_z,
};
use orchard_spec::{Purpose, Stream};
use parry3d_f64::math::Vector;
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape;
use parry3d_f64::utils::Array2;
use std::sync::Arc;

/// Agreement asked of two float implementations at metres of range, f32 output [m].
const TOLERANCE: f64 = 1e-5;

/// A uniformly distributed rotation.
fn rotation(rng: &mut Stream) -> Rotation {
    let twist = rng.uniform(-3.2, 3.2);
    rotation_from_z(&direction(rng)) * Rotation::from_axis_angle(&Vec3::z_axis(), twist)
}

fn vector(v: &Vec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// Range parameter of the nearest triangle.
fn nearest_of(triangles: impl Iterator<Item = shape::Triangle>, ray: &Ray) -> Option<f64> {
    triangles.filter_map(|t| t.cast_local_ray(ray, 1e3, false)).min_by(f64::total_cmp)
}

/// Range parameter of the nearest surface of one item along p + t d.
fn cast(item: &Item, p: &Vec3, d: &Vec3) -> Option<f64> {
    let x = &item.x_world_item;
    let d = x.rotation.inverse() * d;
    let ray = |offset: &Vec3| Ray::new(vector(&(inverse_transform(x, p) - offset)), vector(&d));
    let here = ray(&Vec3::zeros());
    match &item.geometry {
        &Geometry::Shape(Shape::Sphere { radius }) => {
            shape::Ball::new(radius).cast_local_ray(&here, 1e3, false)
        }
        &Geometry::Shape(Shape::Capsule { radius, length }) => {
            let capsule = shape::Capsule::new(Vector::ZERO, Vector::new(0.0, 0.0, length), radius);
            capsule.cast_local_ray(&here, 1e3, false)
        }
        Geometry::Shape(Shape::Box { half }) => {
            shape::Cuboid::new(vector(half)).cast_local_ray(&here, 1e3, false)
        }
        Geometry::Shape(Shape::HalfSpace) => {
            shape::HalfSpace::new(Vector::new(0.0, 0.0, 1.0)).cast_local_ray(&here, 1e3, false)
        }
        // Triangle by triangle: parry's own traversals of both miss hits.
        Geometry::Shape(Shape::ConvexHull(hull)) => {
            let (v, faces) = hull.parry().to_trimesh();
            let corners = faces.into_iter().map(|face| face.map(|k| v[k as usize]));
            nearest_of(corners.map(|[a, b, c]| shape::Triangle::new(a, b, c)), &here)
        }
        Geometry::Shape(Shape::HeightField(field)) => {
            // Parry's y is up: its (x, y, z) are our (y, z, x).
            let turned = |v: Vector| Vector::new(v.y, v.z, v.x);
            let [dx, dy] = field.spacing();
            let size = [dx * (field.columns() - 1) as f64, dy * (field.rows() - 1) as f64];
            let heights = Array2::new(field.columns(), field.rows(), field.heights().to_vec());
            let same = shape::HeightField::new(heights, Vector::new(size[1], 1.0, size[0]));
            nearest_of(same.triangles(), &Ray::new(turned(here.origin), turned(here.dir)))
        }
        &Geometry::Blade { length, width } => {
            let v = blade::vertices(length, width);
            let faces = blade::triangles();
            let triangle =
                |[a, b, c]: [usize; 3]| shape::Triangle::new(vector(&v[a]), vector(&v[b]), vector(&v[c]));
            nearest_of(faces.into_iter().map(triangle), &here)
        }
    }
}

/// Nearest surface of the scene and its item.
fn nearest(scene: &Scene, p: &Vec3, d: &Vec3) -> Option<(f64, usize)> {
    let hits = scene.items.iter().enumerate().filter_map(|(i, item)| Some((cast(item, p, d)?, i)));
    hits.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Compares every pixel; a ray that grazes a silhouette within rounding may differ, and is counted instead.
fn compare(scene: &Scene, k: &Intrinsics, x: &Pose, near: f64, far: f64) -> (usize, usize) {
    let mut frame = Frame::new(1, 1);
    render(scene, k, x, near, far, &mut frame);
    let (mut grazing, mut valid) = (0, 0);
    for v in 0..k.height {
        for u in 0..k.width {
            let ray = k.ray(u as f64, v as f64);
            let hit = nearest(scene, &x.translation.vector, &(x.rotation * ray));
            let expected = hit.filter(|(z, _)| (near..=far).contains(z));
            let z = f64::from(frame.depth[(u, v)]);
            let agrees = match expected {
                Some((t, i)) => {
                    let item = &scene.items[i];
                    let same = frame.label[(u, v)] == item.label && frame.instance[(u, v)] == item.instance;
                    (z - t).abs() <= TOLERANCE && same
                }
                None => {
                    z == 0.0 && frame.label[(u, v)] == Label::None && frame.instance[(u, v)] == NO_INSTANCE
                }
            };
            valid += usize::from(expected.is_some());
            if !agrees {
                // The ray turned by 1e-6 rad either way must meet the two answers.
                let answers: Vec<Option<f64>> = [(-1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
                    .map(|(du, dv)| {
                        let ray = k.ray(u as f64 + 1e-4 * du, v as f64 + 1e-4 * dv);
                        nearest(scene, &x.translation.vector, &(x.rotation * ray))
                            .map(|h| h.0)
                            .filter(|z| (near..=far).contains(z))
                    })
                    .into();
                let explained = answers.iter().any(|a| (a.unwrap_or(0.0) - z).abs() <= 1e-3);
                assert!(explained, "({u}, {v}): rendered {z}, cast {hit:?}, around {answers:?}");
                grazing += 1;
            }
        }
    }
    (grazing, valid)
}

#[test]
fn orchard_scenes_agree() {
    let k = Intrinsics::from_vertical_fov(192, 144, 75_f64.to_radians());
    let eyes = [[-0.6, 0.1, 1.2], [0.3, -0.2, 1.0]];
    for (i, eye) in eyes.into_iter().enumerate() {
        let scene = common::orchard(i as u64, 350, 40);
        let x = look_at(&Vec3::from(eye), &Vec3::new(0.05, 0.0, 0.9));
        let (grazing, valid) = compare(&scene, &k, &x, 0.3, 3.0);
        assert!(valid > 2000, "the image must show something: {valid}");
        assert!(grazing * 1000 <= valid, "{grazing} of {valid}");
    }
}

/// Random shapes all around the camera: through the near plane, behind, about it.
#[test]
fn random_shapes_around_the_camera_agree() {
    let k = Intrinsics { width: 48, height: 40, fx: 30.0, fy: 41.0, cx: 20.3, cy: 22.8 };
    let mut rng = Stream::new(5, 0, Purpose::Test);
    let (mut grazing, mut valid) = (0, 0);
    for _ in 0..300 {
        let mut scene = Scene::default();
        for i in 0..4 {
            let size = rng.uniform(0.02, 0.6);
            let geometry = match rng.integer(0, 6) {
                0 => Geometry::Shape(Shape::Sphere { radius: size }),
                1 => Geometry::Shape(Shape::Capsule { radius: 0.3 * size, length: rng.uniform(0.0, 2.0) }),
                2 => Geometry::Shape(Shape::Box { half: Vec3::from_fn(|_, _| rng.uniform(0.01, 0.5)) }),
                3 => Geometry::Blade { length: 2.0 * size, width: size },
                4 => Geometry::Shape(Shape::HalfSpace),
                5 => {
                    let cloud: Vec<Vec3> = (0..12).map(|_| direction(&mut rng) * size).collect();
                    Geometry::Shape(Shape::ConvexHull(Arc::new(ConvexHull::new(&cloud).unwrap())))
                }
                _ => {
                    let heights = (0..30).map(|_| rng.uniform(-0.1, 0.1)).collect();
                    let field = HeightField::new(5, 6, [0.3 * size, 0.4 * size], heights).unwrap();
                    Geometry::Shape(Shape::HeightField(Arc::new(field)))
                }
            };
            let p = direction(&mut rng) * rng.uniform(0.0, 1.5);
            scene.push(geometry, Pose::from_parts(p.into(), rotation(&mut rng)), Label::Wood, i);
        }
        let x = Pose::from_parts((0.2 * direction(&mut rng)).into(), rotation(&mut rng));
        let (g, n) = compare(&scene, &k, &x, 0.1, 2.5);
        grazing += g;
        valid += n;
    }
    assert!(valid > 100_000 && grazing * 1000 <= valid, "{grazing} of {valid}");
}
