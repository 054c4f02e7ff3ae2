//! Motion against closed forms and conservation laws.

use super::common;

use common::*;
use nalgebra::Translation3;
use orchard_geometry::{Mat3, Pose, Vec3, math};
use orchard_multibody::*;

const H: f64 = 1.0 / 180.0;

fn inertia(mass: f64, p_com: Vec3) -> SpatialInertia {
    SpatialInertia { mass, p_com, i_com: Mat3::identity() * (0.01 * mass) }
}

fn run(model: &Model, data: &mut Data, h: f64, gravity: Vec3, steps: usize) {
    let mut report = StepReport::default();
    for _ in 0..steps {
        step(model, data, &settings(h, gravity), &mut report);
    }
}

#[test]
fn a_free_body_and_a_free_point_fall() {
    let mut builder = ModelBuilder::new();
    builder.add_body(Body {
        parent: None,
        joint: JointKind::Free,
        x_parent_joint: Pose::identity(),
        inertia: inertia(2.0, Vec3::new(0.1, 0.0, 0.0)),
    });
    builder.add_point(PointBody { mass: 0.2, spin_inertia: f64::INFINITY, tether: None });
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    data.point_v_world[0] = Vec3::new(1.0, 0.0, 2.0);
    run(&model, &mut data, H, GRAVITY, 180);
    // Symplectic Euler: z = -g h^2 n (n + 1) / 2 exactly.
    let fallen = 9.81 * H * H * 0.5 * 180.0 * 181.0;
    assert!((data.q[2] + fallen).abs() < 1e-12);
    assert!((data.v[2] + 9.81).abs() < 1e-12);
    assert!((data.point_p_world[0] - Vec3::new(1.0, 0.0, 2.0 - fallen)).norm() < 1e-12);
}

#[test]
fn a_point_falls_at_its_terminal_speed() {
    let mut builder = ModelBuilder::new();
    builder.add_point(PointBody { mass: 0.16, spin_inertia: f64::INFINITY, tether: None });
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    data.point_quadratic_drag[0] = 0.001;
    run(&model, &mut data, H, GRAVITY, 180 * 30);
    let terminal = (0.16_f64 * 9.81 / 0.001).sqrt();
    assert!((data.point_v_world[0].z + terminal).abs() < 1e-6 * terminal);
}

#[test]
fn link_drag_brings_the_centre_of_mass_to_its_terminal_speed() {
    let mut builder = ModelBuilder::new();
    builder.add_body(Body {
        parent: None,
        joint: JointKind::Free,
        x_parent_joint: Pose::identity(),
        inertia: inertia(2.0, Vec3::new(0.1, 0.0, 0.0)),
    });
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    data.linear_drag[0] = 4.0;
    data.angular_drag[0] = 2.0;
    data.v[5] = 0.5;
    run(&model, &mut data, H, GRAVITY, 1800);
    assert!((data.point_velocity_world(BodyId(0), &data.com_p_world(BodyId(0))).z + 9.81 / 4.0).abs() < 1e-9);
    assert!(data.velocity(BodyId(0)).angular.norm() < 1e-8);
}

#[test]
fn a_pendulum_has_its_period() {
    let mut builder = ModelBuilder::new();
    builder.add_body(Body {
        parent: None,
        joint: JointKind::Hinge(Vec3::y_axis()),
        x_parent_joint: Pose::identity(),
        inertia: inertia(1.3, Vec3::new(0.0, 0.0, -0.5)),
    });
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    data.q[0] = 0.02;
    let h = 1e-4;
    let (mut crossings, mut last, mut time) = (Vec::new(), data.q[0], 0.0);
    let mut report = StepReport::default();
    while crossings.len() < 5 {
        step(&model, &mut data, &settings(h, GRAVITY), &mut report);
        time += h;
        if last < 0.0 && data.q[0] >= 0.0 {
            crossings.push(time - h * data.q[0] / (data.q[0] - last));
        }
        last = data.q[0];
    }
    let period = (crossings[4] - crossings[0]) / 4.0;
    let (mass, arm): (f64, f64) = (1.3, 0.5);
    let expected = std::f64::consts::TAU * ((0.01 * mass + mass * arm * arm) / (mass * 9.81 * arm)).sqrt();
    // Amplitude 0.02 rad lengthens the period by 1/16 of its square, 2.5e-5.
    assert!((period / expected - 1.0 - 0.02 * 0.02 / 16.0).abs() < 2e-6, "{period} {expected}");
}

#[test]
fn a_released_tree_never_gains_energy() {
    for seed in 0..4 {
        let (model, mut data) = sprung_tree(seed, 25);
        for k in 0..data.q.len() {
            data.q[k] = 0.3 * math::sin(k as f64);
        }
        forward_kinematics(&model, &mut data);
        let mut last = energy(&model, &data, &GRAVITY).total();
        let first = last;
        let mut report = StepReport::default();
        for _ in 0..900 {
            step(&model, &mut data, &settings(H, GRAVITY), &mut report);
            let now = energy(&model, &data, &GRAVITY).total();
            assert!(now <= last + 1e-9 * first.abs(), "seed {seed}: {last} to {now}");
            last = now;
        }
        assert!(last < first);
    }
}

/// Linear and angular momentum about the world origin.
fn momentum(model: &Model, data: &Data) -> (Vec3, Vec3) {
    let (mut linear, mut angular) = (Vec3::zeros(), Vec3::zeros());
    for id in model.body_ids() {
        let com = data.com_p_world(id);
        let p = data.point_velocity_world(id, &com) * model.body(id).inertia.mass;
        let turn = data.x_world_body(id).rotation.to_rotation_matrix();
        let i_com = turn.matrix() * model.body(id).inertia.i_com * turn.matrix().transpose();
        linear += p;
        angular += com.cross(&p) + i_com * data.velocity(id).angular;
    }
    (linear, angular)
}

#[test]
fn a_floating_articulation_keeps_its_momentum_to_first_order() {
    let mut rng = stream(21);
    let mut builder = ModelBuilder::new();
    for index in 0..7 {
        let joint = if index == 0 { 4 } else { index % 4 };
        builder.add_body(Body {
            parent: (index > 0).then(|| BodyId((index as u32 - 1) / 2)),
            joint: random_joint(&mut rng, joint),
            x_parent_joint: Pose::from_parts(random_vec(&mut rng, 0.3).into(), random_rotation(&mut rng)),
            inertia: random_inertia(&mut rng),
        });
    }
    let model = builder.build().unwrap();
    let start = {
        let mut data = Data::new(&model);
        data.v.iter_mut().for_each(|v| *v = rng.uniform(-1.0, 1.0));
        let dofs = data.v.len();
        data.stiffness[6..dofs].fill(5.0);
        data.damping[6..dofs].fill(0.1);
        forward_kinematics(&model, &mut data);
        data
    };
    let before = momentum(&model, &start);
    let drift = |steps: usize| {
        let mut data = start.clone();
        run(&model, &mut data, 0.5 / steps as f64, Vec3::zeros(), steps);
        let after = momentum(&model, &data);
        ((after.0 - before.0).norm() / before.0.norm(), (after.1 - before.1).norm() / before.1.norm())
    };
    let (coarse, fine) = (drift(500), drift(1000));
    assert!(fine.0 < 5e-3 && fine.1 < 5e-3, "{fine:?}");
    for (coarse, fine) in [(coarse.0, fine.0), (coarse.1, fine.1)] {
        let order = math::ln(coarse / fine) / std::f64::consts::LN_2;
        assert!((0.9..1.1).contains(&order), "order {order}: {coarse:e} {fine:e}");
    }
}

#[test]
fn a_sprung_chain_overstates_a_cantilever_by_its_closed_form() {
    // n joints of k = EI / l at the base of each of n cells of length l, load F at the tip:
    // sum over joints of F (L - x)^2 / k = (F L^3 / 3 EI) (1 + 3/(2n) + 1/(2n^2)).
    let (length, ei, load) = (0.5, 2.0, 1e-3);
    for n in [1, 2, 5, 10, 40] {
        let cell = length / f64::from(n);
        let mut builder = ModelBuilder::new();
        for index in 0..n as u32 {
            let offset = if index == 0 { 0.0 } else { cell };
            builder.add_body(Body {
                parent: index.checked_sub(1).map(BodyId),
                joint: JointKind::Universal,
                x_parent_joint: Translation3::new(0.0, 0.0, offset).into(),
                inertia: SpatialInertia {
                    mass: 0.01,
                    p_com: Vec3::new(0.0, 0.0, 0.5 * cell),
                    i_com: Mat3::identity() * 1e-6,
                },
            });
        }
        let model = builder.build().unwrap();
        let mut data = Data::new(&model);
        data.stiffness.fill(ei / cell);
        let last = BodyId(n as u32 - 1);
        // The load at the tip, as force and torque at the centre of mass.
        data.body_force_world[last.index()] = Vec3::x() * load;
        data.body_torque_world[last.index()] = Vec3::new(0.0, 0.0, 0.5 * cell).cross(&(Vec3::x() * load));
        equilibrium(&model, &mut data, &Vec3::zeros(), 1e-13).unwrap();
        let tip = orchard_geometry::transform(data.x_world_body(last), &Vec3::new(0.0, 0.0, cell));
        let n = f64::from(n);
        let beam = load * length * length * length / (3.0 * ei);
        let expected = beam * (1.0 + 1.5 / n + 0.5 / (n * n));
        assert!((tip.x / expected - 1.0).abs() < 1e-3, "{n}: {} for {expected}", tip.x);
    }
}

/// A tree of sprung universal joints growing upwards, with hanging points, that gravity bends.
fn sprung_tree(seed: u64, links: usize) -> (Model, Data) {
    let mut rng = stream(seed);
    let mut builder = ModelBuilder::new();
    for index in 0..links {
        builder.add_body(Body {
            parent: (index > 0).then(|| BodyId((rng.unit() * index as f64) as u32)),
            joint: if index == 5 { JointKind::Weld } else { JointKind::Universal },
            x_parent_joint: Pose::from_parts(
                Translation3::new(0.0, 0.0, if index == 0 { 0.0 } else { 0.1 }),
                orchard_geometry::Rotation::from_scaled_axis(random_vec(&mut rng, 0.4)),
            ),
            inertia: SpatialInertia {
                mass: 0.05,
                p_com: Vec3::new(0.0, 0.0, 0.05),
                i_com: Mat3::from_diagonal(&Vec3::new(4e-5, 4e-5, 1e-6)),
            },
        });
        if index % 3 == 2 {
            let weight = 0.16 * 9.81;
            let takes_weight_off = index % 2 == 0;
            builder.add_point(PointBody {
                mass: 0.16,
                spin_inertia: f64::INFINITY,
                tether: Some(Tether {
                    body: BodyId(index as u32),
                    p_body: Vec3::new(0.0, 0.0, 0.1),
                    offset_world: Vec3::new(0.0, 0.0, -0.06),
                    stiffness: 300.0,
                    damping: 2.0,
                    anchor_bias_world: Vec3::z() * if takes_weight_off { weight } else { 0.0 },
                    reaction_cap: 10.0,
                    turns: false,
                }),
            });
        }
    }
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    for dof in 0..model.nv() {
        data.stiffness[dof] = rng.uniform(30.0, 90.0);
        data.damping[dof] = 0.05 * data.stiffness[dof];
    }
    data.linear_drag.fill(0.5);
    data.angular_drag.fill(0.5);
    (model, data)
}

#[test]
fn a_tree_in_equilibrium_stays_there() {
    for seed in 0..4 {
        let (model, mut data) = sprung_tree(seed, 40);
        equilibrium(&model, &mut data, &GRAVITY, 1e-13).unwrap();
        assert!(data.q.iter().any(|q| q.abs() > 1e-3), "gravity bends it");
        let start = data.clone();
        run(&model, &mut data, H, GRAVITY, 1800);
        let drift = std::iter::zip(&data.q, &start.q).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        let points = std::iter::zip(&data.point_p_world, &start.point_p_world)
            .fold(0.0_f64, |most, (a, b)| most.max((a - b).norm()));
        assert!(drift.max(points) < 1e-9, "seed {seed}: {drift:e} {points:e}");
    }
}

#[test]
fn equilibrium_holds_what_has_no_spring() {
    let (model, mut data) = sprung_tree(3, 10);
    data.stiffness[4..6].fill(0.0);
    data.tethered[0] = false;
    data.q[4] = 0.2;
    let damping = data.damping.clone();
    let point = data.point_p_world[0];
    equilibrium(&model, &mut data, &GRAVITY, 1e-12).unwrap();
    assert_eq!(data.q[4], 0.2);
    assert_eq!(data.q[5], 0.0);
    assert_eq!(data.point_p_world[0], point);
    assert_eq!(data.damping, damping);
}

#[test]
fn equilibrium_reports_a_buckling_column() {
    let (model, mut data) = sprung_tree(1, 40);
    data.stiffness.fill(1e-3);
    data.damping.fill(0.0);
    let outcome = equilibrium(&model, &mut data, &(GRAVITY * 1e3), 1e-13);
    assert!(matches!(outcome, Err(StaticsError::NotConverged { .. })), "{outcome:?}");
}

/// A rigid hinge arm on the x axis with a point tethered at its end.
fn arm_with_point(reaction_cap: f64) -> (Model, Data) {
    let mut builder = ModelBuilder::new();
    let arm = builder.add_body(Body {
        parent: None,
        joint: JointKind::Hinge(Vec3::y_axis()),
        x_parent_joint: Pose::identity(),
        inertia: inertia(0.5, Vec3::new(0.25, 0.0, 0.0)),
    });
    builder.add_point(PointBody {
        mass: 0.2,
        spin_inertia: f64::INFINITY,
        tether: Some(Tether {
            body: arm,
            p_body: Vec3::new(0.5, 0.0, 0.0),
            offset_world: Vec3::new(0.0, 0.0, -0.1),
            stiffness: 300.0,
            damping: 5.0,
            anchor_bias_world: Vec3::zeros(),
            reaction_cap,
            turns: false,
        }),
    });
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    data.stiffness.fill(50.0);
    data.damping.fill(5.0);
    (model, data)
}

#[test]
fn a_capped_tether_loads_its_anchor_with_the_cap() {
    let gravity = Vec3::zeros();
    let pull = Vec3::new(0.0, 0.0, -20.0);
    let torque_on_arm = |cap: f64| {
        let (model, mut data) = arm_with_point(cap);
        data.point_force_world[0] = pull;
        run(&model, &mut data, H, gravity, 3600);
        let force = data.tether_spring_force(&model, PointId(0));
        assert!((force + pull).norm() < 1e-6, "the point feels its full spring: {force}");
        data.stiffness[0] * data.q[0] / (0.5 * math::cos(data.q[0]))
    };
    assert!((torque_on_arm(f64::INFINITY) - 20.0).abs() < 1e-6);
    assert!((torque_on_arm(25.0) - 20.0).abs() < 1e-6);
    assert!((torque_on_arm(10.0) - 10.0).abs() < 1e-6);
}

/// A force that a body at the point bears in turn caps no tether, as contacts do not: the step is that of an external force without a cap.
#[test]
fn a_paired_force_caps_no_tether() {
    let gravity = Vec3::zeros();
    let pull = Vec3::new(0.0, 0.0, -200.0);
    let after = |cap: f64, is_paired: bool| {
        let (model, mut data) = arm_with_point(cap);
        let force = if is_paired { &mut data.point_paired_force_world } else { &mut data.point_force_world };
        force[0] = pull;
        run(&model, &mut data, H, gravity, 1);
        [data.v[0], data.point_v_world[0].z]
    };
    let free = after(f64::INFINITY, false);
    assert_eq!(after(10.0, true), free);
    assert!((after(10.0, false)[0] - free[0]).abs() > 0.1 * free[0].abs());
}

#[test]
fn an_untethered_point_leaves_with_its_momentum() {
    let (model, mut data) = arm_with_point(f64::INFINITY);
    data.point_v_world[0] = Vec3::new(0.3, 0.2, 0.1);
    data.tethered[0] = false;
    run(&model, &mut data, H, Vec3::zeros(), 10);
    assert_eq!(data.point_v_world[0], Vec3::new(0.3, 0.2, 0.1));
    assert_eq!(data.q[0], 0.0);
    assert_eq!(data.tether_spring_force(&model, PointId(0)), Vec3::zeros());
}

#[test]
fn the_same_step_gives_the_same_bits() {
    let model = random_tree(5, 30);
    let run_once = |data: &Data| {
        let mut data = data.clone();
        run(&model, &mut data, H, GRAVITY, 20);
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        (bits(&data.q), bits(&data.v), data.point_p_world.clone())
    };
    let data = random_data(&model, 6);
    let first = run_once(&data);
    assert_eq!(first, run_once(&data));
    // A world restored in the middle continues like the original; so does a world rebuilt from its state and inputs.
    let mut fresh = random_data(&model, 6);
    run(&model, &mut fresh, H, GRAVITY, 7);
    fresh.clone_from(&data);
    assert_eq!(first, run_once(&fresh));
}

#[test]
fn kinematics_follow_the_step() {
    let model = random_tree(5, 12);
    let mut data = random_data(&model, 6);
    run(&model, &mut data, H, GRAVITY, 3);
    let mut again = Data::new(&model);
    again.q.clone_from(&data.q);
    again.v.clone_from(&data.v);
    forward_kinematics(&model, &mut again);
    for id in model.body_ids() {
        assert_eq!(data.x_world_body(id), again.x_world_body(id));
        assert_eq!(data.velocity(id), again.velocity(id));
    }
}
