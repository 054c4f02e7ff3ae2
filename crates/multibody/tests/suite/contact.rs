//! Contact against closed forms.

use super::common;

use common::touching::*;
use common::*;
use nalgebra::Translation3;
use orchard_geometry::{Mat3, Pose, Rotation, Shape, Vec3, math};
use orchard_multibody::*;

fn point(mass: f64) -> PointBody {
    PointBody { mass, spin_inertia: f64::INFINITY, tether: None }
}

#[test]
fn a_ball_rests_where_the_spring_carries_its_weight() {
    for mass in [0.1, 1.0, 5.0] {
        let mut builder = ModelBuilder::new();
        let radius = 0.04;
        let ball = builder.add_body(free_body(mass, Mat3::identity() * (0.4 * mass * radius * radius)));
        builder.add_collider(collider(Owner::World, Shape::HalfSpace, Pose::identity(), 0.5));
        builder.add_collider(collider(Owner::Body(ball), Shape::Sphere { radius }, Pose::identity(), 0.5));
        let model = builder.build().unwrap();
        let mut data = Data::new(&model);
        data.q[2] = 0.06;
        let report = run(&model, &mut data, 3.0);
        let sink = mass * 9.81 / STIFFNESS;
        let got = radius - data.q[2];
        assert!((got - sink).abs() < 1e-6 * sink, "mass {mass}: sinks {got}, law {sink}");
        assert_eq!(report.contacts.len(), 1);
        // The half-space is a, and the ball pushes it down.
        assert!((report.contacts[0].force_world - Vec3::new(0.0, 0.0, -9.81 * mass)).norm() < 1e-6 * mass);
    }
}

#[test]
fn a_point_body_sticks_or_slides_on_a_slope_by_coulomb() {
    let angle: f64 = 0.4;
    let (s, c) = math::sin_cos(angle);
    for factor in [0.5, 0.95, 1.05, 2.0] {
        let friction = factor * s / c;
        let mut builder = ModelBuilder::new();
        let block = builder.add_point(point(0.16));
        let ball = Shape::Sphere { radius: 0.035 };
        builder.add_collider(collider(Owner::World, Shape::HalfSpace, tilted(angle), friction));
        builder.add_collider(collider(Owner::Point(block), ball, Pose::identity(), friction));
        let model = builder.build().unwrap();
        let mut data = Data::new(&model);
        data.point_p_world[0] = tilted(angle).rotation * Vec3::new(0.0, 0.0, 0.035);
        let seconds = 0.5;
        run(&model, &mut data, seconds);
        let downhill = Vec3::new(c, 0.0, -s);
        let speed = data.point_v_world[0].dot(&downhill);
        let expected = 9.81 * (s - friction * c) * seconds;
        if factor < 1.0 {
            assert!((speed - expected).abs() < 0.05 * expected, "{factor}: {speed} for {expected}");
        } else {
            // Creep of the regularised law: tangential regularisation, 1e-4 / m, times the friction impulse.
            assert!(speed.abs() < 1e-4 * H * 9.81 * s, "{factor}: slides at {speed}");
        }
    }
}

/// A sphere of point mass `mass` between two box fingers on slides that press with 70 N each.
fn grip(mass: f64, friction: f64) -> (Model, Data) {
    let mut builder = ModelBuilder::new();
    let radius = 0.035;
    let half = Vec3::new(0.005, 0.01, 0.02);
    for side in [-1.0, 1.0] {
        let finger = builder.add_body(Body {
            parent: None,
            joint: JointKind::Slide(nalgebra::Unit::new_normalize(Vec3::new(-side, 0.0, 0.0))),
            x_parent_joint: Translation3::new(side * (radius + half.x), 0.0, 0.0).into(),
            inertia: SpatialInertia { mass: 0.015, p_com: Vec3::zeros(), i_com: Mat3::identity() * 1e-6 },
        });
        builder.add_collider(collider(Owner::Body(finger), Shape::Box { half }, Pose::identity(), friction));
    }
    builder.add_coupling(Coupling { dof_a: 0, dof_b: 1, ratio: 1.0, stiffness: 1e5, damping: 100.0 });
    let fruit = builder.add_point(point(mass));
    builder.add_collider(collider(Owner::Point(fruit), Shape::Sphere { radius }, Pose::identity(), friction));
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    data.torque.fill(70.0);
    (model, data)
}

#[test]
fn a_grip_holds_above_the_friction_limit_and_slips_below() {
    for mass in [0.001, 0.16, 1.0] {
        let limit = mass * 9.81 / (2.0 * 70.0);
        for (factor, holds) in [(1.05, true), (0.95, false), (3.0, true)] {
            let (model, mut data) = grip(mass, factor * limit);
            // Squeeze first without gravity, so that the grip is settled.
            let mut report = StepReport::default();
            for _ in 0..90 {
                step(&model, &mut data, &settings(H, Vec3::zeros()), &mut report);
                assert!(report.converged);
            }
            let start = data.point_p_world[0].z;
            let seconds = 0.05;
            run(&model, &mut data, seconds);
            let fallen = start - data.point_p_world[0].z;
            let speed = -data.point_v_world[0].z;
            if holds {
                // Creep: tangential regularisation, 1e-4 of the inverse masses, times the friction impulse.
                let creep = 1e-4 * (1.0 / 0.015 + 1.0 / mass) * (0.5 * mass * 9.81 * H);
                assert!(speed < creep, "{mass} kg, {factor}: slips at {speed}, creep {creep}");
            } else {
                let expected = 9.81 * (1.0 - factor) * seconds;
                assert!((speed - expected).abs() < 0.05 * expected, "{mass} kg: {speed} for {expected}");
                assert!(fallen > 0.0);
            }
        }
    }
}

#[test]
fn a_gripped_fruit_is_carried_by_seventy_newton() {
    let (model, mut data) = grip(0.16, 0.8);
    let report = run(&model, &mut data, 2.0);
    assert_eq!(report.contacts.len(), 2);
    for contact in &report.contacts {
        assert!((contact.force_world.dot(&contact.n_world) - 70.0).abs() < 0.01, "{contact:?}");
        assert!(-contact.gap < 2.5e-3);
    }
    let lift: f64 = report.contacts.iter().map(|contact| -contact.force_world.z).sum();
    assert!((lift - 0.16 * 9.81).abs() < 1e-6);
    assert!((data.q[0] - data.q[1]).abs() < 1e-9);
}

#[test]
fn a_heavy_base_pushes_a_twig_without_sinking_in() {
    let mut builder = ModelBuilder::new();
    let base = builder.add_body(Body {
        parent: None,
        joint: JointKind::Planar,
        x_parent_joint: Pose::identity(),
        inertia: SpatialInertia {
            mass: 130.0,
            p_com: Vec3::new(0.0, 0.0, 0.3),
            i_com: Mat3::identity() * 8.0,
        },
    });
    // A 1 g twig, 10 cm long, hanging down over the top of the base by half its length.
    let twig = builder.add_body(Body {
        parent: None,
        joint: JointKind::Universal,
        x_parent_joint: Pose::from_parts(
            Translation3::new(0.6, 0.05, 0.75),
            Rotation::from_scaled_axis(Vec3::x() * std::f64::consts::PI),
        ),
        inertia: SpatialInertia {
            mass: 1e-3,
            p_com: Vec3::new(0.0, 0.0, 0.05),
            i_com: Mat3::from_diagonal(&Vec3::new(8.4e-7, 8.4e-7, 1e-8)),
        },
    });
    let body_box = Shape::Box { half: Vec3::new(0.4, 0.3, 0.35) };
    let wood = Shape::Capsule { radius: 0.003, length: 0.1 };
    builder.add_collider(collider(
        Owner::Body(base),
        body_box,
        Translation3::new(0.0, 0.0, 0.35).into(),
        0.4,
    ));
    builder.add_collider(collider(Owner::Body(twig), wood, Pose::identity(), 0.4));
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    data.v[0] = 1.1;
    let twig_dofs = model.dofs(twig);
    data.stiffness[twig_dofs.clone()].fill(0.05);
    data.damping[twig_dofs].fill(1e-3);
    let mut report = StepReport::default();
    let mut deepest: f64 = 0.0;
    let mut touched = 0;
    for _ in 0..(0.24 / H) as usize {
        step(&model, &mut data, &settings(H, GRAVITY), &mut report);
        assert!(report.converged, "{report:?}");
        for contact in &report.contacts {
            deepest = deepest.max(-contact.gap);
            touched += usize::from(contact.force_world.norm() > 0.0);
        }
    }
    assert!(touched > 10, "{touched}");
    assert!(deepest < 1e-3, "sinks in {deepest}");
    assert!(data.v[0] > 1.09);
    assert!(data.q[4].abs() > 0.5, "the twig gives way: {:?}", &data.q);
}

#[test]
fn shapes_part_along_the_expected_normals() {
    let half = Vec3::new(0.1, 0.2, 0.3);
    let ball = &Shape::Sphere { radius: 0.05 };
    let bar = &Shape::Capsule { radius: 0.02, length: 0.4 };
    let cube = &Shape::Box { half };
    let flat = Rotation::from_scaled_axis(Vec3::y() * std::f64::consts::FRAC_PI_2);
    let at = |x: f64, y: f64, z: f64| Pose::from(Translation3::new(x, y, z));
    // Free shape a over fixed shape b, the normal from b to a, the gap, the number of points.
    let cases = [
        (ball, at(0.0, 0.0, 0.098), ball, at(0.0, 0.0, 0.0), Vec3::z(), -0.002, 1),
        (ball, at(0.068, 0.0, 0.2), bar, at(0.0, 0.0, 0.0), Vec3::x(), -0.002, 1),
        (ball, at(0.0, 0.0, 0.468), bar, at(0.0, 0.0, 0.0), Vec3::z(), -0.002, 1),
        (
            bar,
            Pose::from_parts(Translation3::new(-0.2, 0.038, 0.2), flat),
            bar,
            at(0.0, 0.0, 0.0),
            Vec3::y(),
            -0.002,
            1,
        ),
        (ball, at(0.148, 0.1, 0.0), cube, at(0.0, 0.0, 0.0), Vec3::x(), -0.002, 1),
        (ball, at(0.09, 0.0, 0.0), cube, at(0.0, 0.0, 0.0), Vec3::x(), -0.06, 1),
        (
            bar,
            Pose::from_parts(Translation3::new(-0.05, 0.218, 0.0), flat),
            cube,
            at(0.0, 0.0, 0.0),
            Vec3::y(),
            -0.002,
            2,
        ),
        (cube, at(0.0, 0.0, 0.598), cube, at(0.0, 0.0, 0.0), Vec3::z(), -0.002, 4),
        (cube, at(0.0, 0.0, 0.298), &Shape::HalfSpace, at(0.0, 0.0, 0.0), Vec3::z(), -0.002, 4),
        (
            bar,
            Pose::from_parts(Translation3::new(0.0, 0.0, 0.018), flat),
            &Shape::HalfSpace,
            at(0.0, 0.0, 0.0),
            Vec3::z(),
            -0.002,
            2,
        ),
        (ball, at(0.0, 0.0, 0.052), &Shape::HalfSpace, at(0.0, 0.0, 0.0), Vec3::z(), 0.002, 1),
    ];
    for (index, (a, pose_a, b, pose_b, normal, gap, count)) in cases.into_iter().enumerate() {
        for swap in [false, true] {
            let mut builder = ModelBuilder::new();
            let body = builder.add_body(free_body(1.0, Mat3::identity() * 0.01));
            let moving = collider(Owner::Body(body), a.clone(), pose_a, 0.5);
            let fixed = collider(Owner::World, b.clone(), pose_b, 0.5);
            for part in if swap { [fixed, moving] } else { [moving, fixed] } {
                builder.add_collider(part);
            }
            let model = builder.build().unwrap();
            let mut report = StepReport::default();
            step(&model, &mut Data::new(&model), &settings(H, Vec3::zeros()), &mut report);
            assert_eq!(report.contacts.len(), count, "case {index} {:?}", report.contacts);
            for contact in &report.contacts {
                let expected = if swap { -normal } else { normal };
                assert!((contact.n_world - expected).norm() < 1e-9, "case {index}: {contact:?}");
                assert!((contact.gap - gap).abs() < 1e-9, "case {index}: {contact:?}");
                let push = contact.force_world.dot(&contact.n_world);
                assert!(if gap < 0.0 { push > 0.0 } else { push == 0.0 }, "case {index}: {contact:?}");
            }
        }
    }
}

#[test]
fn a_box_on_the_ground_rests_level() {
    let half = Vec3::new(0.1, 0.15, 0.05);
    let mut builder = ModelBuilder::new();
    let body = builder.add_body(free_body(2.0, Mat3::identity() * 0.01));
    builder.add_collider(collider(Owner::World, Shape::HalfSpace, Pose::identity(), 0.6));
    builder.add_collider(collider(Owner::Body(body), Shape::Box { half }, Pose::identity(), 0.6));
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    data.q[2] = 0.08;
    data.q[3..7].copy_from_slice(Rotation::from_scaled_axis(Vec3::new(0.1, 0.15, 0.3)).coords.as_slice());
    let report = run(&model, &mut data, 4.0);
    let up = data.x_world_body(body).rotation * Vec3::z();
    assert!((up - Vec3::z()).norm() < 1e-3, "{up}");
    let weight: f64 = report.contacts.iter().map(|contact| -contact.force_world.z).sum();
    assert!((weight - 2.0 * 9.81).abs() < 0.02, "{weight}");
    assert!(data.v.iter().all(|v| v.abs() < 1e-3), "{:?}", data.v);
}

#[test]
fn groups_and_owners_keep_pairs_apart() {
    let mut builder = ModelBuilder::new();
    let one = builder.add_point(point(1.0));
    let other = builder.add_point(point(1.0));
    let ball = Shape::Sphere { radius: 0.1 };
    for owner in [Owner::Point(one), Owner::Point(one), Owner::Point(other), Owner::World] {
        builder.add_collider(collider(owner, ball.clone(), Pose::identity(), 0.5));
    }
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    let mut report = StepReport::default();
    step(&model, &mut data.clone(), &settings(H, GRAVITY), &mut report);
    assert_eq!(report.contacts.len(), 5);
    data.groups[2] = Groups::NONE;
    step(&model, &mut data.clone(), &settings(H, GRAVITY), &mut report);
    assert_eq!(report.contacts.len(), 2);
    data.groups.fill(Groups { member: 2, filter: 1 });
    step(&model, &mut data, &settings(H, GRAVITY), &mut report);
    assert!(report.contacts.is_empty());
}

#[test]
fn forty_contacts_on_a_tree_converge_and_balance() {
    // A random tree of links with spheres pressed by a heavy plate from above.
    let mut rng = stream(11);
    let mut builder = ModelBuilder::new();
    let mut links = Vec::new();
    for index in 0..40 {
        let parent = (index > 0).then(|| links[(rng.unit() * index as f64) as usize]);
        let link = builder.add_body(Body {
            parent,
            joint: JointKind::Universal,
            x_parent_joint: Pose::from(nalgebra::Translation3::from(random_vec(&mut rng, 0.1))),
            inertia: SpatialInertia { mass: 0.01, ..random_inertia(&mut rng) },
        });
        links.push(link);
    }
    let plate = builder.add_body(free_body(130.0, Mat3::identity() * 10.0));
    builder.add_collider(collider(
        Owner::Body(plate),
        Shape::Box { half: Vec3::new(2.0, 2.0, 0.5) },
        Pose::identity(),
        0.7,
    ));
    let solid = Groups { member: 2, filter: 1 };
    for &link in &links {
        let mut ball = collider(Owner::Body(link), Shape::Sphere { radius: 0.4 }, Pose::identity(), 0.5);
        ball.groups = solid;
        builder.add_collider(ball);
    }
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    data.groups[0] = Groups { member: 1, filter: 2 };
    let dofs = model.dofs(plate);
    data.stiffness[..dofs.start].fill(20.0);
    data.damping[..dofs.start].fill(1.0);
    data.q[model.qs(plate).start + 2] = 0.9;
    data.v[dofs.start + 2] = -1.0;
    data.v[dofs.start] = 0.5;
    let mut report = StepReport::default();
    let mut most = 0;
    for _ in 0..60 {
        let before = data.v[dofs.start + 2];
        step(&model, &mut data, &settings(H, GRAVITY), &mut report);
        assert!(report.converged, "{} {:e}", report.newton_iterations, report.residual);
        most = most.max(report.contacts.len());
        let on_plate: f64 = report
            .contacts
            .iter()
            .map(|c| if c.a == ColliderId(0) { c.force_world.z } else { -c.force_world.z })
            .sum();
        let change = (data.v[dofs.start + 2] - before) / H;
        assert!((change - (on_plate / 130.0 - 9.81)).abs() < 1e-6 * (1.0 + change.abs()));
    }
    assert!(most > 20, "{most}");
}

/// A ball that may spin rolls down a slope without sliding: a = 5/7 g sin(angle), omega = v / r.
#[test]
fn a_spinning_point_body_rolls() {
    let (mass, radius, angle) = (0.16, 0.03, 0.2);
    let mut builder = ModelBuilder::new();
    let ball =
        builder.add_point(PointBody { mass, spin_inertia: 0.4 * mass * radius * radius, tether: None });
    builder.add_collider(collider(Owner::World, Shape::HalfSpace, tilted(angle), 0.8));
    builder.add_collider(collider(Owner::Point(ball), Shape::Sphere { radius }, Pose::identity(), 0.8));
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    data.point_p_world[0] = tilted(angle) * Vec3::z() * radius;
    let seconds = 1.0;
    run(&model, &mut data, seconds);
    let speed = data.point_v_world[0].norm();
    let exact = 5.0 / 7.0 * 9.81 * math::sin(angle) * seconds;
    // The ball sinks in by m g / k = 1e-3 r, so that it rolls on a radius shorter by half of that.
    assert!((speed / exact - 1.0).abs() < 1e-3, "{speed} against {exact}");
    assert!((data.point_w_world[0].norm() * radius / speed - 1.0).abs() < 1e-3);
}

/// Two balls overlap by 3 mm at the start: accepted, they stay where they are; pushed together by 2 N, they sink in by what the spring gives beyond that.
#[test]
fn accepted_overlaps_count_as_touching() {
    let radius = 0.04;
    let mut builder = ModelBuilder::new();
    let points = [0, 1].map(|_| builder.add_point(point(0.2)));
    for id in points {
        builder.add_collider(collider(Owner::Point(id), Shape::Sphere { radius }, Pose::identity(), 0.5));
    }
    let mut model = builder.build().unwrap();
    let mut start = Data::new(&model);
    start.point_p_world[1].x = 2.0 * radius - 0.003;
    let settings = settings(1.0 / 180.0, Vec3::zeros());
    let distance = |model: &Model, push: f64| {
        let mut data = start.clone();
        data.point_force_world = vec![Vec3::x() * push, Vec3::x() * -push];
        for _ in 0..1800 {
            data.point_v_world.iter_mut().for_each(|v| *v *= 0.9);
            step(model, &mut data, &settings, &mut StepReport::default());
        }
        data.point_p_world[1].x - data.point_p_world[0].x
    };
    assert!(distance(&model, 0.0) > 2.0 * radius - 1e-4, "they part");
    accept_overlaps(&mut model, &start);
    assert_eq!(distance(&model, 0.0), start.point_p_world[1].x);
    let sunk = start.point_p_world[1].x - distance(&model, 2.0);
    assert!((sunk / (2.0 / STIFFNESS) - 1.0).abs() < 1e-3, "{sunk}");
}
