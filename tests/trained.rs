//! Worlds of trained trees: rows with posts and wires, at rest and touched.

use nalgebra::{DMatrix, SymmetricEigen};
use orchard_camera::{Geometry, Item, Label};
use orchard_geometry::{Shape, Vec3, math, transform};
use orchard_multibody::{ColliderId, StepReport};
use orchard_picker::ExpertConfig;
use orchard_robot::RobotModel;
use orchard_spec::{Preset, Spec};
use orchard_world::groups::{LOOSE_GROUPS, SCENERY_GROUPS};
use orchard_world::truth::FruitState;
use orchard_world::{Status, World};
use rayon::prelude::*;
use std::sync::Arc;

const TRAINED: [Preset; 3] = [Preset::TallSpindle, Preset::VTrellis, Preset::VerticalUfo];

fn world(preset: Preset, index: u32) -> World {
    World::new(Arc::new(Spec::preset(preset)), Arc::new(RobotModel::paper()), 42, index)
        .unwrap_or_else(|e| panic!("{preset}, world {index}: {e}"))
}

fn is_scenery(world: &World, id: ColliderId) -> bool {
    world.model().collider(id).groups == SCENERY_GROUPS
}

/// The partners of posts and wires in the contacts of a substep.
fn against_scenery(world: &World, report: &StepReport) -> Vec<ColliderId> {
    let pairs = report.contacts.iter().flat_map(|c| [(c.a, c.b), (c.b, c.a)]);
    pairs.filter(|(a, _)| is_scenery(world, *a)).map(|(_, b)| b).collect()
}

/// Ends and radius of a capsule.
fn capsule(item: &Item) -> Option<(Vec3, Vec3, f64)> {
    match &item.geometry {
        &Geometry::Shape(Shape::Capsule { radius, length }) => {
            let p_tip = transform(&item.x_world_item, &Vec3::new(0.0, 0.0, length));
            Some((item.x_world_item.translation.vector, p_tip, radius))
        }
        _ => None,
    }
}

/// Least distance between the skins of two capsules, from points a hundredth of the first one's length apart.
fn gap(one: (Vec3, Vec3, f64), other: (Vec3, Vec3, f64)) -> f64 {
    let ((a, b, radius_one), (c, d, radius_other)) = (one, other);
    let along = d - c;
    let points = (0..=100).map(|k| a + (b - a) * (f64::from(k) / 100.0));
    let distance = |p: Vec3| {
        let share = ((p - c).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (p - c - along * share).norm()
    };
    points.map(distance).fold(f64::INFINITY, f64::min) - radius_one - radius_other
}

/// With the robot holding still, nothing happens in five seconds: no joint snaps, all fruit hangs, and everything
/// stays where it is to 1e-9 m, as the default tree does.
#[test]
fn rows_hold_still() {
    let hold = RobotModel::paper().start_command();
    let cases: Vec<(Preset, u32)> = TRAINED.iter().flat_map(|&p| (0..4).map(move |i| (p, i))).collect();
    cases.into_par_iter().for_each(|(preset, index)| {
        let mut world = world(preset, index);
        let name = format!("{preset}, world {index}");
        // A trellis has few sites: some trees have no room for the last fruit.
        let (fruit, count) = (world.fruit().len(), world.spec().fruit.count.get() as usize);
        assert!((count - 1..=count).contains(&fruit), "{name}: {fruit}");
        let places = |w: &World| {
            let bodies = w.tree().bodies.iter().map(|&b| w.data().x_world_body(b).translation.vector);
            bodies.chain(w.data().point_p_world.iter().copied()).collect::<Vec<_>>()
        };
        let start = places(&world);
        for _ in 0..300 {
            world.step(&hold);
            assert_eq!(against_scenery(&world, world.report()), [], "{name}");
        }
        assert_eq!(*world.status(), Status::Running, "{name}");
        let events = world.drain_events();
        assert!(events.is_empty(), "{name}: {events:?}");
        assert!(world.fruit_truth().iter().all(|f| f.state == FruitState::OnTree), "{name}");
        let drift = places(&world).iter().zip(&start).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(drift <= 1e-9, "{name}: {drift:e} m");
    });
}

/// No post or wire runs through the trunk, through fruit or through the robot, and no post through any wood.
#[test]
fn posts_and_wires_stand_clear() {
    for preset in TRAINED {
        for index in 0..4 {
            let world = world(preset, index);
            let scene = world.scene();
            let scenery: Vec<_> =
                scene.items.iter().filter(|i| i.label == Label::Scenery).filter_map(capsule).collect();
            let spec = world.spec().scenery.as_ref().unwrap();
            assert!(scenery.len() > spec.wires.get() as usize);
            for item in &scene.items {
                let solid = match (item.label, &item.geometry) {
                    (Label::Wood, _) => capsule(item).unwrap(),
                    (Label::Fruit, &Geometry::Shape(Shape::Sphere { radius })) => {
                        let p = item.x_world_item.translation.vector;
                        (p, p, radius)
                    }
                    _ => continue,
                };
                let is_trunk =
                    item.label == Label::Wood && world.skeleton().segments[item.instance as usize].order == 0;
                for &strut in &scenery {
                    if strut.2 > spec.wire_radius.si() || is_trunk || item.label == Label::Fruit {
                        assert!(gap(solid, strut) > 0.0, "{preset}, world {index}: {item:?}");
                    }
                }
            }
            let base = world.x_world_odom().translation.vector;
            assert!(base.y.abs() > 1.6, "{preset}, world {index}: {base:?}");
        }
    }
}

/// An apple released above a wire comes to rest on it.
#[test]
fn loose_fruit_meets_a_wire() {
    let mut world = world(Preset::VerticalUfo, 0);
    let spec = world.spec().scenery.clone().unwrap();
    let (point, collider) = (world.fruit().points[0], world.fruit().colliders[0]);
    let radius = world.fruit().fruit[0].radius;
    let z_top = spec.lowest_wire.si() + f64::from(spec.wires.get() - 1) * spec.wire_spacing.si();
    let p_world = Vec3::new(4.0, spec.post_radius.si(), z_top + radius + 0.02);
    let data = world.data_mut();
    data.tethered[point.index()] = false;
    data.groups[collider.index()] = LOOSE_GROUPS;
    data.point_p_world[point.index()] = p_world;
    let hold = RobotModel::paper().start_command();
    let met = (0..30).any(|_| {
        world.step(&hold);
        against_scenery(&world, world.report()).contains(&collider)
    });
    assert!(met);
}

/// A limb that breaks off where it crosses a wire falls; the wire does not fling it away.
#[test]
fn a_limb_that_breaks_in_the_wires_falls() {
    let hold = RobotModel::paper().start_command();
    TRAINED.par_iter().for_each(|&preset| {
        let mut world = world(preset, 0);
        let segments = &world.skeleton().segments;
        let limbs: Vec<usize> = (0..segments.len())
            .filter(|&i| segments[i].order == 1 && segments[i].parent.is_some_and(|p| segments[p].order == 0))
            .collect();
        for &limb in &limbs {
            world.break_branch(limb);
        }
        let mut top = 0.0_f64;
        for _ in 0..180 {
            world.step(&hold);
            let bodies = world.tree().bodies.iter();
            top = bodies.fold(top, |top, &b| top.max(world.data().velocity(b).linear.norm()));
        }
        println!("{preset}: {top:.2} m/s of {} limbs", limbs.len());
        assert_eq!(*world.status(), Status::Running, "{preset}");
        // A fall from the tree's top.
        let fall = (2.0 * world.spec().sim.gravity.si() * world.spec().tree.height.si()).sqrt();
        assert!(top < 2.0 * fall, "{preset}: {top}");
    });
}

/// A robot driven at a row beside the tree touches the wires, and the world stays stable.
#[test]
fn the_robot_meets_the_wires() {
    for preset in TRAINED {
        let mut world = world(preset, 1);
        let start = world.x_world_odom();
        // Towards the gap between the tree and the next post, which no branch reaches.
        let p_gap_world = Vec3::new(-1.6, 0.0, 0.0);
        let v_base = start.rotation.inverse() * (p_gap_world - start.translation.vector).normalize() * 0.5;
        let mut drive = RobotModel::paper().start_command();
        drive.base_velocity = [v_base.x, v_base.y, 0.0];
        let mut met = false;
        for _ in 0..360 {
            world.step(&drive);
            met |= !against_scenery(&world, world.report()).is_empty();
        }
        let base = world.handle().x_world_base(world.data()).translation.vector;
        println!("{preset}: from {:?} to {base:?}, met {met}", start.translation.vector);
        assert_eq!(*world.status(), Status::Running, "{preset}");
        assert!(met, "{preset}: {base:?}");
    }
}

/// The wrist camera sees posts or wires from the alley, and the ground truth labels them.
#[test]
fn the_camera_sees_the_row() {
    for preset in TRAINED {
        let seen = (0..4).any(|index| {
            let mut world = world(preset, index);
            world.observe();
            world.camera_truth().unwrap().truth().label.pixels().contains(&Label::Scenery)
        });
        assert!(seen, "{preset}");
    }
}

/// Upright offshoots of a cherry sway at 8-10 Hz, and one of comparable slenderness must lie between 5 and 12 Hz
/// (`ufo_vibration`). An upright clamped at its base, its spurs and their fruit lumped where they grow: the first root of
/// K v = (2 pi f)^2 M v in the bends of its joints, u(z) = sum of theta_i (z - z_i) over the joints below.
#[test]
fn uprights_sway_in_the_measured_band() {
    let mut frequencies = Vec::new();
    for index in 0..4 {
        let world = world(Preset::VerticalUfo, index);
        let segments = &world.skeleton().segments;
        let density = world.spec().wood.density.si();
        let mass = |i: usize| {
            let s = &segments[i];
            let fruit = world.fruit().fruit.iter().filter(|f| f.segment == i).map(|f| f.mass);
            density * std::f64::consts::PI * s.radius * s.radius * s.length + fruit.sum::<f64>()
        };
        let roots = (0..segments.len()).filter(|&i| {
            segments[i].order == 1 && segments[i].parent.is_some_and(|p| segments[p].order == 0)
        });
        for root in roots {
            let carried = world.tree().subtree(root);
            let joints: Vec<usize> = carried.iter().copied().filter(|&i| segments[i].order == 1).collect();
            let z = |i: usize| segments[i].p_base_world.z;
            let n = joints.len();
            let mut inertia = DMatrix::<f64>::zeros(n, n);
            for &i in &carried {
                // Middle of the upright's own wood; spurs and their fruit move with their base.
                let height =
                    if segments[i].order == 1 { 0.5 * (z(i) + segments[i].p_tip_world().z) } else { z(i) };
                let arm: Vec<f64> = joints.iter().map(|&j| (height - z(j)).max(0.0)).collect();
                inertia += DMatrix::from_fn(n, n, |a, b| mass(i) * arm[a] * arm[b]);
            }
            let root_stiffness = |a: usize| world.tree().stiffness[joints[a]].sqrt();
            let scaled =
                DMatrix::from_fn(n, n, |a, b| inertia[(a, b)] / (root_stiffness(a) * root_stiffness(b)));
            let largest = SymmetricEigen::new(scaled).eigenvalues.max();
            frequencies.push(1.0 / (std::f64::consts::TAU * largest.sqrt()));
        }
    }
    frequencies.sort_by(f64::total_cmp);
    let median = frequencies[frequencies.len() / 2];
    println!("{frequencies:.1?}");
    assert!((5.0..=12.0).contains(&median), "{frequencies:.1?}");
}

/// A robot that drives round the end of a row, at the expert's distance from it, has 2 m left to the end of the world.
#[test]
fn the_way_round_a_row_lies_within_the_world() {
    let clearance = ExpertConfig::preset().shared.drive.row_clearance.si();
    for preset in TRAINED {
        let spec = Spec::preset(preset);
        let row = spec.scenery.as_ref().expect("posts and wires");
        let half = 0.5 * f64::from(row.posts.get() - 1) * row.post_spacing.si();
        let farthest = math::hypot(half + clearance, clearance);
        assert!(farthest + 2.0 < spec.sim.plausible_extent.si(), "{preset}: {farthest} m");
    }
}
