//! Worlds on bumpy ground.

use orchard_camera::{Frame, Label, render};
use orchard_fruit::{Phase, Resting};
use orchard_geometry::{Footprint, HeightField, Vec3, transform};
use orchard_multibody::forward_kinematics;
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_tests::state_hash;
use orchard_world::{Status, World, WorldEvent};
use rayon::prelude::*;
use std::sync::Arc;

const AMPLITUDE: f64 = 0.2;

fn spec(amplitude: f64) -> Spec {
    let spec = Spec::paper();
    Spec { terrain: spec.terrain.with_amplitude(amplitude).unwrap(), ..spec }
}

fn world(spec: Spec, seed: u64) -> World {
    World::new(Arc::new(spec), Arc::new(RobotModel::paper()), seed, 0).unwrap()
}

fn hold() -> Command {
    RobotModel::paper().start_command()
}

fn field(world: &World) -> &HeightField {
    world.terrain().expect("bumpy ground")
}

/// Takes a fruit off its stem and puts it somewhere, at rest.
fn put(world: &mut World, fruit: usize, p_world: Vec3) {
    let point = world.fruit().points[fruit].index();
    while world.data().tethered[point] {
        world.data_mut().point_force_world[point] = Vec3::new(0.0, 0.0, 60.0);
        world.step(&hold());
    }
    let data = world.data_mut();
    data.point_force_world[point] = Vec3::zeros();
    data.point_p_world[point] = p_world;
    data.point_v_world[point] = Vec3::zeros();
    data.point_w_world[point] = Vec3::zeros();
    world.drain_events();
}

/// The steepest place 1.2 to 3 m from the trunk and at least 1.2 m from the robot, and the upward normal there.
fn steepest(world: &World) -> (Vec3, Vec3) {
    let robot = world.x_world_odom().translation.vector;
    let middles = field(world).triangles(field(world).cells()).map(|[a, b, c]| {
        let n = (b - a).cross(&(c - a)).normalize();
        ((a + b + c) / 3.0, n)
    });
    let far = |p: &Vec3| (p - robot).norm() > 1.2 && (1.2..3.0).contains(&p.xy().norm());
    middles.filter(|(p, _)| far(p)).min_by(|a, b| a.1.z.total_cmp(&b.1.z)).unwrap()
}

/// Sine of the largest angle between two triangles that share an edge.
fn sharpest(field: &HeightField) -> f64 {
    let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(&(c - a)).normalize();
    let corners =
        |nodes: [[i64; 2]; 3]| Some([field.node(nodes[0])?, field.node(nodes[1])?, field.node(nodes[2])?]);
    let mut sharpest = 0.0_f64;
    for [column, row] in field.cells().iter() {
        let [lower, upper] = HeightField::triangles_of([column, row]);
        let [_, left] = HeightField::triangles_of([column - 1, row]);
        let [_, below] = HeightField::triangles_of([column, row - 1]);
        let Some(lower) = corners(lower).map(normal) else { continue };
        for other in [upper, left, below].into_iter().filter_map(corners).map(normal) {
            sharpest = sharpest.max(lower.cross(&other).norm());
        }
    }
    sharpest
}

/// A fruit laid on the steepest slope rolls down and comes to rest. Its energy rises by no more than it takes to lift it
/// out of the overlap with a triangle that it rolls into within one step, and that is nothing against what it loses.
#[test]
fn a_fruit_rolls_down_a_slope_and_comes_to_rest() {
    (0..6_u64).into_par_iter().for_each(|seed| {
        let mut spec = spec(AMPLITUDE);
        // Every step is seen.
        spec.sim.frame_rate = spec.sim.frame_rate.with_value(180.0).unwrap();
        spec.sim.substeps = spec.sim.substeps.with_value(1).unwrap();
        let (gravity, h) = (spec.sim.gravity.si(), spec.sim.substep());
        let mut world = world(spec, seed);
        let sine = sharpest(field(&world));
        let (p_slope, n) = steepest(&world);
        let (radius, mass) = (world.fruit().fruit[0].radius, world.fruit().fruit[0].mass);
        put(&mut world, 0, p_slope + n * radius);
        let point = world.fruit().points[0].index();
        let mut energies = Vec::new();
        let mut gained = 0.0;
        while !matches!(world.fruit_lives().phase(0), Phase::Asleep(_)) {
            let data = world.data();
            let (v, w) = (data.point_v_world[point], data.point_w_world[point]);
            let spin_inertia = 0.4 * mass * radius * radius;
            let energy = mass * (gravity * data.point_p_world[point].z + 0.5 * v.norm_squared())
                + 0.5 * spin_inertia * w.norm_squared();
            world.step(&hold());
            let rise = energies.last().map_or(0.0, |before| energy - before);
            let into = h * v.norm() * sine;
            assert!(rise <= mass * gravity * into + 1e-9, "seed {seed}: energy rose by {rise:e} J");
            gained += rise.max(0.0);
            energies.push(energy);
            assert!(energies.len() < 180 * 120, "seed {seed}: still rolling after two minutes");
        }
        let lost = energies[0] - energies[energies.len() - 1];
        let p = world.data().point_p_world[point];
        assert!(gained < 0.02 * lost, "seed {seed}: gained {gained:e} J while it lost {lost} J");
        assert!(p.z < p_slope.z + n.z * radius - 0.01, "seed {seed}: it rests {} m high", p.z);
        let sunk = field(&world).signed_distance(&p) - radius;
        assert!(sunk.abs() < 1e-4, "seed {seed}: it rests {sunk} m over the ground");
        assert_eq!(world.fruit_lives().phase(0), Phase::Asleep(Resting::Ground(p)));
        let dropped = |e: &WorldEvent| matches!(e, WorldEvent::FruitDropped { fruit: 0, .. });
        assert_eq!(world.drain_events().iter().filter(|e| dropped(e)).count(), 1);
    });
}

/// A fruit that falls is dropped when it meets the bump under it, with the speed of its fall.
#[test]
fn a_fruit_meets_the_ground_where_the_ground_is() {
    for seed in 0..4 {
        let mut world = world(spec(AMPLITUDE), seed);
        let (p_slope, _) = steepest(&world);
        let radius = world.fruit().fruit[0].radius;
        let start = p_slope + Vec3::new(0.0, 0.0, 0.6);
        put(&mut world, 0, start);
        let mut fall = 0.0;
        while field(&world).signed_distance(&(start - Vec3::z() * fall)) > radius {
            fall += 1e-4;
        }
        let point = world.fruit().points[0].index();
        let speed = loop {
            world.step(&hold());
            let mut events = world.drain_events().into_iter();
            let dropped = |e| match e {
                WorldEvent::FruitDropped { fruit: 0, speed, .. } => Some(speed),
                _ => None,
            };
            if let Some(speed) = events.find_map(dropped) {
                break speed;
            }
            assert!(world.data().point_p_world[point].z > start.z - 1.0, "seed {seed}: through the ground");
        };
        // The last whole frame's speed, two frames' growth at most under that at the touch; drag takes below 1 %.
        let expected = (2.0 * 9.81 * fall).sqrt();
        assert!((0.99 * expected - 2.0 * 9.81 / 60.0..=expected).contains(&speed), "{speed} vs {expected}");
    }
}

/// Bumps of no height: everything as on the plane; fruit to the sag of its contacts.
#[test]
fn level_terrain_is_the_plane() {
    let run = |spec: Spec| {
        let mut world = world(spec, 3);
        put(&mut world, 0, Vec3::new(-1.5, 0.0, 0.4));
        let limb = world.skeleton().segments.iter().position(|s| s.order == 1).unwrap();
        world.break_branch(limb);
        for _ in 0..180 {
            world.step(&Command { base_velocity: [0.0, 0.6, 0.2], ..hold() });
        }
        world
    };
    let (plane, level) = (run(Spec::paper()), run(spec(0.0)));
    let apart = |a: &Vec3, b: &Vec3| (a - b).norm();
    let robot = |w: &World| w.handle().x_world_base(w.data()).translation.vector;
    assert!(apart(&robot(&plane), &robot(&level)) < 1e-9);
    let fruit = |w: &World| w.data().point_p_world[w.fruit().points[0].index()];
    // On an edge between two triangles it has two contacts, and half the sag of some micrometres.
    assert!(apart(&fruit(&plane), &fruit(&level)) < 1e-5, "{} {}", fruit(&plane), fruit(&level));
}

/// At the start the base stands on the ground under it, which is the height that its odometry counts from.
#[test]
fn the_robot_starts_on_the_ground_and_stays() {
    for seed in 0..8 {
        let mut world = world(spec(AMPLITUDE), seed);
        let base = |w: &World| w.handle().x_world_base(w.data());
        let start = base(&world);
        assert_eq!(start.translation.vector, world.x_world_odom().translation.vector);
        assert_eq!(start.translation.z, highest(&world));
        assert_eq!(world.observe().base_height, 0.0);
        for _ in 0..60 {
            world.step(&hold());
        }
        assert!((base(&world).translation.vector - start.translation.vector).norm() < 1e-9, "seed {seed}");
        assert!(world.drain_events().is_empty());
    }
}

/// Height of the highest ground under the chassis.
fn highest(world: &World) -> f64 {
    let x_world_base = world.handle().x_world_base(world.data());
    let chassis = RobotModel::paper().chassis();
    let centre = transform(&x_world_base, &(0.5 * (chassis.min + chassis.max)));
    let ahead = x_world_base.rotation * Vec3::x();
    let half = 0.5 * (chassis.max - chassis.min);
    let footprint =
        Footprint { centre: [centre.x, centre.y], ahead: [ahead.x, ahead.y], half: [half.x, half.y] };
    field(world).highest_under(&footprint).unwrap()
}

/// At top speed over the highest bumps the chassis keeps on top of them, and near them.
#[test]
fn the_chassis_rides_over_bumps() {
    let drives = [
        [-1.1, 0.0, 0.0],
        [0.0, 1.1, 0.0],
        [0.0, -1.1, 0.0],
        [-0.8, 0.8, 0.0],
        [-1.1, 0.0, 1.0],
        [0.0, 1.1, -0.6],
    ];
    (0..12_usize).into_par_iter().for_each(|case| {
        let mut world = world(spec(AMPLITUDE), case as u64);
        let (mut lowest, mut highest_over) = (f64::INFINITY, 0.0_f64);
        let mut steepest = 0.0_f64;
        let mut last = highest(&world);
        for _ in 0..300 {
            world.step(&Command { base_velocity: drives[case % drives.len()], ..hold() });
            let z = world.handle().x_world_base(world.data()).translation.z;
            let ground = highest(&world);
            steepest = steepest.max((ground - last) * 60.0);
            last = ground;
            lowest = lowest.min(z - ground);
            highest_over = highest_over.max(z - ground);
            let height = world.observe().base_height;
            assert!((height - (z - world.x_world_odom().translation.z)).abs() < 1e-12);
        }
        assert_eq!(*world.status(), Status::Running);
        println!("case {case}: {lowest} m, {} ms of climb", -1e3 * lowest / steepest);
        // The servo is short by about 5 ms of climb (`LAGS_AHEAD` in the world's ground); the steepest climb reported here is a mean
        // over a frame, less than that of the moment.
        assert!(lowest > -6e-3 * steepest, "case {case}: {lowest} m under the ground");
        assert!(highest_over < AMPLITUDE, "case {case}: {highest_over} m over the ground");
    });
}

/// A limb that breaks comes to lie on the bumps, not in them.
#[test]
fn debris_lies_on_the_bumps() {
    for seed in [17, 18] {
        let mut world = world(spec(AMPLITUDE), seed);
        let limb = world.skeleton().segments.iter().position(|s| s.order == 1).unwrap();
        world.break_branch(limb);
        for _ in 0..600 {
            world.step(&hold());
        }
        assert_eq!(*world.status(), Status::Running);
        let (mut debris, mut lying) = (0, 0);
        for (i, segment) in world.skeleton().segments.iter().enumerate() {
            if world.rupture().is_debris(i) {
                let x = world.data().x_world_body(world.tree().bodies[i]);
                let tip = transform(x, &Vec3::new(0.0, 0.0, segment.length));
                let gap = field(&world).signed_distance(&tip) - segment.radius;
                assert!(gap > -2e-3, "seed {seed}, segment {i}: {gap} m");
                debris += 1;
                lying += usize::from(gap < 5e-3);
            }
        }
        assert!(debris > 5 && lying > 0, "seed {seed}: {lying} of {debris} lie");
    }
}

/// Every pixel of the wrist camera that shows the ground lies on it, and drawing only the parts in range loses none.
#[test]
fn the_camera_sees_the_ground_where_it_is() {
    let mut seen = 0;
    for seed in 0..4 {
        let mut spec = spec(AMPLITUDE);
        spec.foliage.density = spec.foliage.density.with_value(0.0).unwrap();
        let mut world = world(spec, seed);
        // Turns the wrist down.
        let q = world.model().qs(world.handle().arm[5]).start;
        world.data_mut().q[q] -= 0.9;
        let model = world.model().clone();
        forward_kinematics(&model, world.data_mut());
        let observation = world.observe();
        let (depth, intrinsics) = (observation.depth.unwrap(), observation.intrinsics);
        let x_world_camera = world.x_world_camera();
        let truth = world.camera_truth().unwrap();
        let (near, far) = world.spec().camera.range();
        let mut whole = Frame::new(intrinsics.width, intrinsics.height);
        render(&truth.sight.scene(), &intrinsics, &x_world_camera, near, 1e6, &mut whole);
        let in_range = |z: &f32| if f64::from(*z) <= far { *z } else { 0.0 };
        let expected: Vec<f32> = whole.depth.pixels().iter().map(in_range).collect();
        assert!(depth.pixels() == expected, "seed {seed}");
        for v in 0..depth.height() {
            for u in 0..depth.width() {
                if truth.truth().label[(u, v)] == Label::Ground {
                    let p_camera = intrinsics.back_project(u as f64, v as f64, f64::from(depth[(u, v)]));
                    let p = transform(&x_world_camera, &p_camera);
                    let z = field(&world).height(p.x, p.y).unwrap();
                    // f32 depth of up to 3 m on slopes below 2.
                    assert!((p.z - z).abs() < 2e-6, "pixel ({u}, {v}): {} over {z}", p.z);
                    seen += 1;
                }
            }
        }
    }
    assert!(seen > 10_000, "{seen} pixels");
}

/// A world on bumps continues from a snapshot with the same bits; one on other bumps refuses it.
#[test]
fn snapshots_know_their_ground() {
    let drive = Command { base_velocity: [-0.7, 0.4, 0.3], ..hold() };
    let mut one = world(spec(0.1), 5);
    for _ in 0..40 {
        one.step(&drive);
    }
    let snapshot = one.snapshot();
    let mut two = world(spec(0.1), 5);
    two.restore(&snapshot).unwrap();
    for _ in 0..40 {
        one.step(&drive);
        two.step(&drive);
    }
    assert_eq!(state_hash(&one), state_hash(&two));
    let mut other = world(spec(0.11), 5);
    assert!(other.restore(&snapshot).unwrap_err().to_string().contains("another spec"));
}

/// Even on the highest bumps nothing that grows is under the ground: fruit and wood meet the ground only once they fall.
#[test]
fn no_tree_grows_into_the_bumps() {
    (0..40_u64).into_par_iter().for_each(|seed| {
        let world = world(spec(AMPLITUDE), seed);
        for (i, fruit) in world.fruit_truth().iter().enumerate() {
            assert!(field(&world).signed_distance(&fruit.p_world) > fruit.radius, "seed {seed}, fruit {i}");
        }
        for (i, segment) in world.skeleton().segments.iter().enumerate() {
            let x = world.data().x_world_body(world.tree().bodies[i]);
            let tip = transform(x, &Vec3::new(0.0, 0.0, segment.length));
            assert!(field(&world).signed_distance(&tip) > segment.radius, "seed {seed}, segment {i}");
        }
    });
}
