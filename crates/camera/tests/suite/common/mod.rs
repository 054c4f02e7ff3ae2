//! A hand-made orchard scene of nominal size: 150 pieces of wood, 40 fruit, 350 leaves, 15 robot parts, ground.

use orchard_camera::{Geometry, Label, Scene, blade::BladeMesh};
use orchard_geometry::{Pose, Rotation, Shape, Vec3, rotation_from_z};
use orchard_spec::{Purpose, Spec, Stream};
use std::sync::Arc;

pub mod direction;

use direction::direction;

/// Wood from `base` towards `heading` in four internodes; returns them as (base, heading, radius).
fn limb(rng: &mut Stream, base: Vec3, heading: Vec3, length: f64, radius: f64) -> Vec<(Vec3, Vec3, f64)> {
    let (mut p, mut h) = (base, heading);
    let mut out = Vec::new();
    for i in 0..4 {
        out.push((p, h, radius * (1.0 - 0.15 * f64::from(i))));
        p += h * (0.25 * length);
        h = (h + 0.2 * direction(rng) + Vec3::new(0.0, 0.0, -0.05)).normalize();
    }
    out.push((p, h, 0.5 * radius));
    out
}

fn outward(rng: &mut Stream, axis: &Vec3, spread: f64) -> Vec3 {
    let side = axis.cross(&direction(rng)).normalize();
    (axis + side * spread).normalize()
}

/// A tree at the origin with a robot-like pile of shapes at x = -1.2 m.
pub fn orchard(seed: u64, leaves: usize, fruit: usize) -> Scene {
    let mut rng = Stream::new(seed, 0, Purpose::Test);
    let mut scene = Scene::default();
    scene.push(Geometry::Shape(Shape::HalfSpace), Pose::identity(), Label::Ground, 0);
    let mut wood = Vec::new();
    let trunk = limb(&mut rng, Vec3::zeros(), Vec3::z(), 1.6, 0.035);
    let mut twigs = Vec::new();
    for i in 0..7 {
        let (p, h, r) = trunk[1 + i % 4];
        let heading = outward(&mut rng, &h, 1.2);
        let scaffold = limb(&mut rng, p, heading, rng_length(i), 0.6 * r);
        for &(p, h, r) in &scaffold[1..5] {
            let heading = outward(&mut rng, &h, 0.9);
            let twig = limb(&mut rng, p, heading, 0.3, (0.5 * r).max(0.004));
            twigs.extend_from_slice(&twig[1..]);
            wood.push((twig, 0.3));
        }
        wood.push((scaffold, rng_length(i)));
    }
    wood.push((trunk, 1.6));
    let mut index = 0;
    for (limb, length) in &wood {
        for &(p, h, radius) in &limb[..4] {
            let shape = Shape::Capsule { radius, length: 0.25 * length };
            scene.push(
                Geometry::Shape(shape),
                Pose::from_parts(p.into(), rotation_from_z(&h)),
                Label::Wood,
                index,
            );
            index += 1;
        }
    }
    let any = |rng: &mut Stream| twigs[rng.integer(0, twigs.len() as u32 - 1) as usize];
    let mut placed: Vec<Vec3> = Vec::new();
    while placed.len() < fruit {
        let radius = rng.uniform(0.026, 0.035);
        let p = any(&mut rng).0 - Vec3::z() * (0.025 + radius) + 0.01 * direction(&mut rng);
        if placed.iter().all(|q| (p - q).norm() > 0.07) {
            let shape = Shape::Sphere { radius };
            scene.push(
                Geometry::Shape(shape),
                Pose::from_parts(p.into(), Rotation::identity()),
                Label::Fruit,
                placed.len() as u32,
            );
            placed.push(p);
        }
    }
    let mesh = Arc::new(BladeMesh::from_spec(&Spec::paper().foliage));
    for i in 0..leaves {
        let (p, h, _) = any(&mut rng);
        let along = outward(&mut rng, &h, 1.0);
        let up = (Vec3::z() + 0.6 * direction(&mut rng)).normalize();
        let y = up.cross(&along).try_normalize(1e-6).unwrap_or_else(Vec3::x);
        let axes = nalgebra::Matrix3::from_columns(&[along, y, along.cross(&y)]);
        let r = Rotation::from_matrix(&axes);
        let p = p + h * rng.uniform(0.0, 0.07);
        scene.push(
            Geometry::Blade {
                mesh: mesh.clone(),
                length: rng.uniform(0.07, 0.1),
                width: rng.uniform(0.04, 0.06),
            },
            Pose::from_parts(p.into(), r),
            Label::Leaf,
            i as u32,
        );
    }
    robot(&mut scene);
    scene
}

fn rng_length(i: usize) -> f64 {
    0.55 + 0.05 * i as f64
}

/// Fifteen boxes and capsules standing in for a mobile manipulator.
fn robot(scene: &mut Scene) {
    let mut add = |shape, p: [f64; 3], towards: [f64; 3]| {
        let r = rotation_from_z(&Vec3::from(towards).normalize());
        let i = scene.items.len() as u32;
        scene.push(Geometry::Shape(shape), Pose::from_parts(Vec3::from(p).into(), r), Label::Robot, i);
    };
    add(Shape::Box { half: Vec3::new(0.48, 0.40, 0.14) }, [-1.3, 0.0, 0.2], [0.0, 0.0, 1.0]);
    for (x, y) in [(-1.6, 0.33), (-1.6, -0.33), (-1.0, 0.33), (-1.0, -0.33)] {
        add(Shape::Sphere { radius: 0.09 }, [x, y, 0.09], [0.0, 0.0, 1.0]);
    }
    for (dx, dy, hx, hy) in
        [(0.15, 0.0, 0.01, 0.15), (-0.15, 0.0, 0.01, 0.15), (0.0, 0.15, 0.15, 0.01), (0.0, -0.15, 0.15, 0.01)]
    {
        add(Shape::Box { half: Vec3::new(hx, hy, 0.075) }, [-1.56 + dx, dy, 0.42], [0.0, 0.0, 1.0]);
    }
    let joints =
        [[-1.15, 0.0, 0.34], [-1.15, 0.0, 0.68], [-1.25, 0.0, 0.98], [-0.95, 0.0, 1.2], [-0.8, 0.0, 1.15]];
    for w in joints.windows(2) {
        let d = Vec3::from(w[1]) - Vec3::from(w[0]);
        add(Shape::Capsule { radius: 0.06, length: d.norm() }, w[0], d.into());
    }
    add(Shape::Box { half: Vec3::new(0.02, 0.10, 0.03) }, [-0.74, 0.0, 1.14], [0.0, 0.0, 1.0]);
    add(Shape::Box { half: Vec3::new(0.03, 0.01, 0.01) }, [-0.69, 0.04, 1.14], [0.0, 0.0, 1.0]);
}
