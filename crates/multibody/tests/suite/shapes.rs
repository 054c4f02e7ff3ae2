//! Hulls and terrain: rest, rolling and driving against closed forms.

use super::common;

use std::sync::Arc;

use common::touching::*;
use common::*;
use orchard_geometry::{ConvexHull, HeightField, Mat3, Pose, Rotation, Shape, Vec3, math};
use orchard_multibody::*;

fn ball_inertia(mass: f64, radius: f64) -> Mat3 {
    Mat3::identity() * (0.4 * mass * radius * radius)
}

/// A square field of `count` x `count` nodes with heights `z(x, y)`.
fn field(count: usize, spacing: f64, z: impl Fn(f64, f64) -> f64) -> Shape {
    let at = |k: usize| spacing * (k as f64 - 0.5 * (count - 1) as f64);
    let heights = (0..count * count).map(|k| z(at(k % count), at(k / count))).collect();
    Shape::HeightField(Arc::new(HeightField::new(count, count, [spacing; 2], heights).unwrap()))
}

fn hull(points: &[Vec3]) -> Shape {
    Shape::ConvexHull(Arc::new(ConvexHull::new(points).unwrap()))
}

fn box_corners(half: &Vec3) -> Vec<Vec3> {
    (0..8)
        .map(|k| Vec3::from_fn(|axis, _| if k >> axis & 1 == 0 { -half[axis] } else { half[axis] }))
        .collect()
}

/// One body on one piece of ground.
fn on_ground(
    ground: Shape,
    x_world_ground: Pose,
    shape: Shape,
    inertia: (f64, Mat3),
    friction: f64,
) -> Model {
    let mut builder = ModelBuilder::new();
    let body = builder.add_body(free_body(inertia.0, inertia.1));
    builder.add_collider(collider(Owner::World, ground, x_world_ground, friction));
    builder.add_collider(collider(Owner::Body(body), shape, Pose::identity(), friction));
    builder.build().unwrap()
}

fn place(data: &mut Data, pose: &Pose) {
    data.q[..3].copy_from_slice(pose.translation.vector.as_slice());
    data.q[3..7].copy_from_slice(pose.rotation.coords.as_slice());
}

/// Force on the body: it is collider 1, the ground is a.
fn force_on_body(report: &StepReport) -> Vec3 {
    -report.contacts.iter().map(|contact| contact.force_world).sum::<Vec3>()
}

/// Seams of terrain: a ball on a plane of triangles moves as on a half-space, sticking or sliding, at every step.
#[test]
fn a_ball_on_a_tilted_field_moves_as_on_a_tilted_half_space() {
    let angle = 0.35;
    let (mass, radius) = (0.5, 0.05);
    for friction in [0.02, 0.1, 0.8] {
        let model = |ground: Shape, pose: Pose| {
            on_ground(ground, pose, Shape::Sphere { radius }, (mass, ball_inertia(mass, radius)), friction)
        };
        // A slope made of the heights, and a flat field that is tilted.
        let slope = -math::tan(angle);
        let grounds = [
            model(Shape::HalfSpace, tilted(angle)),
            model(field(81, 0.05, |x, _| slope * x), Pose::identity()),
            model(field(81, 0.05, |_, _| 0.0), tilted(angle)),
        ];
        let mut states = grounds.each_ref().map(Data::new);
        let start = tilted(angle) * Vec3::new(-1.2, 0.013, radius);
        for data in &mut states {
            place(data, &Pose::from_parts(start.into(), Rotation::identity()));
        }
        let mut reports = [StepReport::default(), StepReport::default(), StepReport::default()];
        for count in 0..(0.8 / H) as usize {
            for ((model, data), report) in grounds.iter().zip(&mut states).zip(&mut reports) {
                step(model, data, &settings(H, GRAVITY), report);
                assert_eq!(report.contacts.len(), 1, "step {count}: {report:?}");
            }
            for other in 1..3 {
                let dq = (0..7).map(|k| (states[other].q[k] - states[0].q[k]).abs()).fold(0.0, f64::max);
                assert!(dq < 1e-9, "friction {friction}, ground {other}, step {count}: {dq:e}");
                let df = (force_on_body(&reports[other]) - force_on_body(&reports[0])).norm();
                assert!(df < 1e-7 * mass * 9.81, "friction {friction}, step {count}: {df:e}");
            }
        }
        // It has gone over many cells, and Coulomb's bound has held.
        assert!(states[0].q[0] - start.x > 0.5);
        let force = tilted(angle).inverse() * force_on_body(&reports[1]);
        let tangential = math::hypot(force.x, force.y);
        assert!(tangential <= friction * force.z * (1.0 + 1e-9));
    }
}

/// A dip z = c (x^2 + y^2), sampled: a pit of four planes about the lowest node, of slope c times the spacing. The ball
/// comes to rest over the node to what friction holds: half the weight's sinking, over the slope.
#[test]
fn a_ball_rests_in_a_dip_at_its_lowest_point() {
    let (mass, radius) = (0.2, 0.04);
    let (x0, y0) = (0.1, -0.05);
    let dip = field(41, 0.05, |x, y| 0.8 * ((x - x0) * (x - x0) + (y - y0) * (y - y0)));
    let model =
        on_ground(dip, Pose::identity(), Shape::Sphere { radius }, (mass, ball_inertia(mass, radius)), 0.6);
    let mut data = Data::new(&model);
    place(&mut data, &Pose::translation(x0 + 0.2, y0 + 0.11, 0.1 + radius));
    data.angular_drag.fill(3.0);
    data.linear_drag.fill(1.0);
    let report = run(&model, &mut data, 30.0);
    let held = 0.5 * (mass * 9.81 / STIFFNESS) / (0.8 * 0.05);
    assert!((data.q[0] - x0).abs() < held && (data.q[1] - y0).abs() < held, "{:?}", &data.q[..3]);
    let lift = force_on_body(&report);
    assert!((lift - Vec3::z() * (mass * 9.81)).norm() < 1e-3 * mass * 9.81, "{lift}");
    assert!(data.v.iter().all(|v| v.abs() < 1e-4), "{:?}", data.v);
}

/// The hull of a cube falls, lands and rests as the box does, on a half-space, on flat terrain and on a box, and stays.
#[test]
fn a_hull_of_a_box_rests_as_the_box_does_and_does_not_rock() {
    let half = Vec3::new(0.1, 0.15, 0.05);
    let mass = 2.0;
    let sides = half.component_mul(&half);
    let i_com = Mat3::from_diagonal(&Vec3::new(sides.y + sides.z, sides.x + sides.z, sides.x + sides.y))
        * (mass / 3.0);
    let slab = Shape::Box { half: Vec3::new(1.0, 1.0, 0.2) };
    let grounds = [
        (Shape::HalfSpace, Pose::identity()),
        (field(21, 0.07, |_, _| 0.0), Pose::identity()),
        (slab, Pose::translation(0.0, 0.0, -0.2)),
        (hull(&box_corners(&Vec3::new(1.0, 1.0, 0.2))), Pose::translation(0.0, 0.0, -0.2)),
    ];
    let sink = mass * 9.81 / (4.0 * STIFFNESS);
    for (index, (ground, pose)) in grounds.into_iter().enumerate() {
        for shape in [Shape::Box { half }, hull(&box_corners(&half))] {
            let model = on_ground(ground.clone(), pose, shape, (mass, i_com), 0.6);
            let mut data = Data::new(&model);
            let turn = Rotation::from_scaled_axis(Vec3::new(0.1, 0.15, 0.3));
            place(&mut data, &Pose::from_parts(Vec3::new(0.02, 0.03, 0.08).into(), turn));
            run(&model, &mut data, 4.0);
            let rest = data.q.clone();
            let report = run(&model, &mut data, 5.0);
            assert_eq!(report.contacts.len(), 4, "ground {index}: {report:?}");
            // The corners carry the weight in four equal parts.
            assert!(
                (half.z - data.q[2] - sink).abs() < 1e-3 * sink,
                "ground {index}: {}",
                half.z - data.q[2]
            );
            let tilt = data.x_world_body(BodyId(0)).rotation * Vec3::z() - Vec3::z();
            assert!(tilt.norm() < 1e-6, "ground {index}: {tilt}");
            for (now, before) in data.q.iter().zip(&rest) {
                assert!((now - before).abs() < 1e-6, "ground {index}: it moves from {before} to {now}");
            }
            assert!(data.v.iter().all(|v| v.abs() < 1e-7), "ground {index}: {:?}", data.v);
        }
    }
}

/// A disc with twenty corners: more corners than parry's manifolds and our own contact points have room for.
#[test]
fn a_round_plate_rests_on_a_box_without_tipping() {
    let rim = |z: f64| {
        (0..20).map(move |k| {
            let (s, c) = math::sin_cos(std::f64::consts::TAU * f64::from(k) / 20.0);
            Vec3::new(0.1 * c, 0.1 * s, z)
        })
    };
    let points: Vec<Vec3> = rim(-0.01).chain(rim(0.01)).collect();
    let mass = 1.0;
    let i_com = Mat3::from_diagonal(&Vec3::new(0.0026, 0.0026, 0.005));
    let slab = Shape::Box { half: Vec3::new(1.0, 1.0, 0.2) };
    let model = on_ground(slab, Pose::translation(0.0, 0.0, -0.2), hull(&points), (mass, i_com), 0.5);
    let mut data = Data::new(&model);
    place(&mut data, &Pose::translation(0.0, 0.0, 0.012));
    let report = run(&model, &mut data, 3.0);
    assert_eq!(report.contacts.len(), 8);
    assert!((force_on_body(&report) - Vec3::z() * (mass * 9.81)).norm() < 1e-6);
    let tilt = data.x_world_body(BodyId(0)).rotation * Vec3::z() - Vec3::z();
    // Eight of twenty corners do not share the weight quite evenly: less than the sinking across the plate.
    assert!(tilt.norm() < mass * 9.81 / (8.0 * STIFFNESS) / 0.1, "{tilt}");
    assert!(data.v.iter().all(|v| v.abs() < 1e-6), "{:?}", data.v);
}

/// Distance of a capsule from a hull, where corners and edges meet: exact.
#[test]
fn distances_of_hull_and_capsule_are_exact() {
    let cube = hull(&box_corners(&Vec3::repeat(0.1)));
    let bar = Shape::Capsule { radius: 0.01, length: 0.3 };
    let side = 0.5_f64.sqrt();
    // Across an edge, off a corner (its end nearest), over a face; with the distance of the axis.
    let up = |p: Vec3, to: Vec3| Pose::from_parts(p.into(), orchard_geometry::rotation_from_z(&to));
    let out = Vec3::new(side, 0.0, side) * 0.015;
    let off = Vec3::repeat(0.013 / 3.0_f64.sqrt());
    let cases = [
        (up(Vec3::new(0.1, -0.15, 0.1) + out, Vec3::y()), 0.015),
        (
            up(
                Vec3::new(0.1, 0.05, 0.1) + out - Vec3::new(side, 0.0, -side) * 0.15,
                Vec3::new(side, 0.0, -side),
            ),
            0.015,
        ),
        (up(Vec3::repeat(0.1) + off, Vec3::repeat(1.0).normalize()), 0.013),
        (up(Vec3::new(-0.2, 0.03, 0.112), Vec3::x()), 0.012),
    ];
    for (index, (pose, distance)) in cases.into_iter().enumerate() {
        let model =
            on_ground(cube.clone(), Pose::identity(), bar.clone(), (1.0, Mat3::identity() * 0.01), 0.5);
        let mut data = Data::new(&model);
        place(&mut data, &pose);
        let mut report = StepReport::default();
        step(&model, &mut data, &settings(H, Vec3::zeros()), &mut report);
        let least = report.contacts.iter().map(|contact| contact.gap).fold(f64::INFINITY, f64::min);
        assert!((least - (distance - 0.01)).abs() < 1e-12, "case {index}: {least}, {report:?}");
    }
}

/// Icosphere: the icosahedron's faces split in four and put on the sphere, `level` times.
fn icosphere(level: u32, radius: f64) -> Vec<Vec3> {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut points = Vec::new();
    for (a, b) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
        points.extend([Vec3::new(a, b, 0.0), Vec3::new(0.0, a, b), Vec3::new(b, 0.0, a)]);
    }
    for _ in 0..level {
        let start = ConvexHull::new(&points).unwrap();
        points.extend(start.edges().iter().map(|edge| {
            let [p, q] = edge.vertices.map(|k| start.vertices()[k as usize].normalize());
            p + q
        }));
        points.iter_mut().for_each(|p| *p = p.normalize());
    }
    points.iter().map(|p| p.normalize() * radius).collect()
}

/// Polyhedra in a sphere come as close to it as the square of their edges: four times nearer at every split.
#[test]
fn icospheres_approach_the_sphere_at_second_order() {
    let radius = 0.1;
    let mut rng = stream(3);
    let directions: Vec<Vec3> = (0..200).map(|_| random_vec(&mut rng, 1.0).normalize()).collect();
    let mut errors = Vec::new();
    for level in 0..3 {
        let shape = hull(&icosphere(level, radius));
        let model = on_ground(
            shape,
            Pose::identity(),
            Shape::Sphere { radius: 0.03 },
            (1.0, ball_inertia(1.0, 0.03)),
            0.5,
        );
        let mut sum = 0.0;
        for direction in &directions {
            let mut data = Data::new(&model);
            let centre = direction * (radius + 0.03 - 0.025);
            place(&mut data, &Pose::from_parts(centre.into(), Rotation::identity()));
            let mut report = StepReport::default();
            step(&model, &mut data, &settings(H, Vec3::zeros()), &mut report);
            let least = report.contacts.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
            assert!(least.is_finite());
            sum += least + 0.025;
        }
        errors.push(sum / directions.len() as f64);
    }
    let orders: Vec<f64> =
        errors.windows(2).map(|e| math::ln(e[0] / e[1]) / std::f64::consts::LN_2).collect();
    assert!(orders.iter().all(|order| (1.7..2.3).contains(order)), "{errors:?} {orders:?}");
}

/// Gentle hills: 4 cm high, 1.6 m long, in cells of 5 cm.
fn hills() -> Shape {
    field(121, 0.05, |x, y| {
        0.02 * math::sin(2.0 * std::f64::consts::PI * x / 1.6) + 0.01 * math::sin(3.0 * y)
    })
}

/// A 130 kg chassis, pushed at 1 m/s over hills on four corners: it stays out of the ground as the law has it.
fn drive(seconds: f64) -> (Data, f64, f64, usize) {
    let half = Vec3::new(0.48, 0.40, 0.14);
    let mass = 130.0;
    let sides = half.component_mul(&half);
    let i_com = Mat3::from_diagonal(&Vec3::new(sides.y + sides.z, sides.x + sides.z, sides.x + sides.y))
        * (mass / 3.0);
    let model = on_ground(hills(), Pose::identity(), Shape::Box { half }, (mass, i_com), 0.3);
    let mut data = Data::new(&model);
    place(&mut data, &Pose::translation(-2.0, 0.0, half.z + 0.035));
    let (mut deepest, mut fastest, mut most) = (0.0_f64, 0.0_f64, 0);
    let mut report = StepReport::default();
    for count in 0..(seconds / H) as usize {
        // A servo on the speed, and one on the heading.
        data.body_force_world[0] = Vec3::new(2000.0 * (1.0 - data.v[0]), 0.0, 0.0);
        data.body_torque_world[0] = Vec3::new(0.0, 0.0, -50.0 * data.v[5]);
        step(&model, &mut data, &settings(H, GRAVITY), &mut report);
        assert!(report.converged, "step {count}: {report:?}");
        assert!(report.contacts.len() <= 8);
        most = most.max(report.contacts.len());
        if count > 90 {
            for contact in &report.contacts {
                deepest = deepest.max(-contact.gap);
            }
            fastest = fastest.max(data.v[2].abs());
        }
    }
    (data, deepest, fastest, most)
}

#[test]
fn a_chassis_drives_over_hills_on_the_ground() {
    let (data, deepest, fastest, most) = drive(4.0);
    assert!(data.q[0] > 1.0, "it has gone {} m", data.q[0] + 2.0);
    // Two corners may carry the chassis on a slope of 0.08, and 1 m/s over it is braked within some steps; the
    // law sinks by load / stiffness, with the load at most a few times the weight.
    let sink = 130.0 * 9.81 / (2.0 * STIFFNESS);
    assert!(
        deepest > 0.1 * sink && deepest < 3.0 * sink,
        "sinks by {deepest}, {sink} standing on two corners"
    );
    // It never jumps: the slope times the speed, doubled for pitching.
    assert!(fastest < 0.25, "{fastest}");
    assert!(most >= 3);
}

#[test]
fn terrain_and_hulls_give_the_same_bits_again() {
    let (one, two) = (drive(1.0).0, drive(1.0).0);
    assert_eq!(one.q, two.q);
    assert_eq!(one.v, two.v);
}

/// Bodies of every kind thrown on rough ground lose their energy and lie on it, none in it.
#[test]
fn bodies_of_every_kind_come_to_rest_on_rough_ground() {
    let mut rng = stream(8);
    let heights: Vec<f64> = (0..41 * 41).map(|_| rng.uniform(0.0, 0.05)).collect();
    let rough = HeightField::new(41, 41, [0.08; 2], heights).unwrap();
    let rough = Arc::new(rough);
    // A spring that takes up the whole fall, from 0.45 m with 1.7 m/s: v sqrt(m / k).
    let speed = (1.7_f64 * 1.7 + 2.0 * 9.81 * 0.45).sqrt();
    let stop = speed * (0.5 / STIFFNESS).sqrt();
    for index in 0..16 {
        let shape = match index % 4 {
            0 => Shape::Sphere { radius: 0.06 },
            1 => Shape::Capsule { radius: 0.02, length: 0.2 },
            2 => Shape::Box { half: Vec3::new(0.1, 0.06, 0.03) },
            _ => hull(&(0..14).map(|_| random_vec(&mut rng, 0.1)).collect::<Vec<_>>()),
        };
        let ground = Shape::HeightField(rough.clone());
        let model = on_ground(ground, Pose::identity(), shape, (0.5, Mat3::identity() * 1e-3), 0.7);
        let mut data = Data::new(&model);
        let at = Vec3::new(0.2 * f64::from(index % 5) - 0.4, 0.2 * f64::from(index / 5) - 0.4, 0.4);
        place(&mut data, &Pose::from_parts(at.into(), random_rotation(&mut rng)));
        data.v.iter_mut().for_each(|v| *v = rng.uniform(-1.0, 1.0));
        // Rolling finds no resistance but this.
        data.angular_drag.fill(1.0);
        let mut report = StepReport::default();
        for count in 0..(15.0 / H) as usize {
            step(&model, &mut data, &settings(H, GRAVITY), &mut report);
            assert!(report.converged, "step {count}: {} {:e}", report.newton_iterations, report.residual);
            assert!(report.contacts.iter().all(|contact| -contact.gap < stop), "body {index}: {report:?}");
        }
        let p = data.com_p_world(BodyId(0));
        let above = p.z - rough.height(p.x, p.y).expect("on the field");
        assert!(above > 0.01, "body {index} is {above} over the ground");
        // What is left is the creep of sticking contacts, and the last rolling.
        assert!(data.v.iter().all(|v| v.abs() < 1e-3), "body {index}: {:?}", data.v);
    }
}
