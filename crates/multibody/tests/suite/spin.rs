//! Fast turns: velocity products add no energy, however far a link turns in a substep.

use super::common;

use common::*;
use orchard_geometry::{Mat3, Pose, Vec3};
use orchard_multibody::*;

const H: f64 = 1.0 / 180.0;
/// Round-off of a kinetic energy, relative: sums over some hundred terms.
const ROUND_OFF: f64 = 1e-11;

fn kinetic(model: &Model, data: &Data) -> f64 {
    energy(model, data, &Vec3::zeros()).kinetic
}

/// The state a substep ago: `q - h v` with the same v.
fn looked_back(model: &Model, data: &Data, h: f64) -> Data {
    let mut back = data.clone();
    flow(model, &mut back, -h);
    forward_kinematics(model, &mut back);
    back
}

fn without_forces(model: &Model, seed: u64, rate: f64) -> Data {
    let mut data = random_data(model, seed);
    for input in [&mut data.stiffness, &mut data.damping, &mut data.torque] {
        input.fill(0.0);
    }
    data.linear_drag.fill(0.0);
    data.angular_drag.fill(0.0);
    data.body_force_world.fill(Vec3::zeros());
    data.body_torque_world.fill(Vec3::zeros());
    data.tethered.fill(false);
    data.point_v_world.fill(Vec3::zeros());
    data.point_force_world.fill(Vec3::zeros());
    data.v.iter_mut().for_each(|v| *v *= rate);
    forward_kinematics(model, &mut data);
    data
}

/// The step is a projection: the velocities after it, at the pose before it, hold no more energy than the velocities
/// before it did at the pose before that. One step of random trees of every joint kind, with rates of 100 to 1e5 rad/s.
#[test]
fn a_fast_step_adds_no_energy() {
    for seed in 0..60 {
        let model = random_tree(seed, 4 + seed as usize % 20);
        for rate in [100.0, 1e3, 1e5] {
            let start = without_forces(&model, 900 + seed, rate);
            let before = kinetic(&model, &looked_back(&model, &start, H));
            let mut data = start.clone();
            step(&model, &mut data, &settings(H, Vec3::zeros()), &mut StepReport::default());
            let mut after = start;
            after.v.copy_from_slice(&data.v);
            forward_kinematics(&model, &mut after);
            let after = kinetic(&model, &after);
            assert!(after <= before * (1.0 + ROUND_OFF), "seed {seed}, {rate}: {after} J of {before} J");
        }
    }
}

/// Thin rods of 10 cm on free universal joints.
fn chain(links: u32) -> Model {
    let (length, radius, mass): (f64, f64, f64) = (0.1, 0.003, 0.01);
    let across = mass * (3.0 * radius * radius + length * length) / 12.0;
    let mut builder = ModelBuilder::new();
    for index in 0..links {
        builder.add_body(Body {
            parent: index.checked_sub(1).map(BodyId),
            joint: JointKind::Universal,
            x_parent_joint: Pose::translation(0.0, 0.0, if index == 0 { 0.0 } else { length }),
            inertia: SpatialInertia {
                mass,
                p_com: Vec3::z() * (0.5 * length),
                i_com: Mat3::from_diagonal(&Vec3::new(across, across, 0.5 * mass * radius * radius)),
            },
        });
    }
    builder.build().unwrap()
}

/// Chains without springs, drag or gravity, at 30 to 100 rad/s, for 20 s. With explicit velocity products their energy grew
/// without end (1e3-fold within 0.02 to 2 s, then to overflow). Links that turn faster than the larger threshold lose
/// energy, slower ones may gain: the energy ends at or under that of links which all turn by the larger threshold, 0.2 rad in a
/// substep, swinging stretched out from the root.
#[test]
fn free_chains_do_not_run_away() {
    for links in [1, 2, 3, 5, 10, 20] {
        let model = chain(links);
        for (seed, rate) in [(1, 30.0), (2, 60.0), (3, 100.0)] {
            let mut data = Data::new(&model);
            let mut rng = stream(seed);
            data.q.iter_mut().for_each(|q| *q = rng.uniform(-1.0, 1.0));
            data.v.iter_mut().for_each(|v| *v = rng.uniform(-rate, rate));
            forward_kinematics(&model, &mut data);
            let start = kinetic(&model, &looked_back(&model, &data, H));
            // A rod of the chain's length and mass at that rate: 1/2 (m L^2 / 3) w^2.
            let (mass, length) = (0.01 * f64::from(links), 0.1 * f64::from(links));
            let threshold = mass * length * length / 6.0 * (0.2 / H) * (0.2 / H);
            let mut report = StepReport::default();
            for count in 0..(20.0 / H) as usize {
                step(&model, &mut data, &settings(H, Vec3::zeros()), &mut report);
                let now = kinetic(&model, &looked_back(&model, &data, H));
                assert!(now <= start.max(threshold), "{links} links, {rate} rad/s, step {count}: {now} J");
            }
        }
    }
}

/// A free body keeps spinning: its rotational energy is kept to 1 % a second at a quarter of a radian a substep, and its
/// linear momentum to round-off.
#[test]
fn a_fast_free_body_keeps_its_motion() {
    let mut builder = ModelBuilder::new();
    builder.add_body(Body {
        parent: None,
        joint: JointKind::Free,
        x_parent_joint: Pose::identity(),
        inertia: SpatialInertia {
            mass: 0.5,
            p_com: Vec3::new(0.01, -0.02, 0.03),
            i_com: Mat3::from_diagonal(&Vec3::new(1e-3, 2e-3, 2.5e-3)),
        },
    });
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    data.v.copy_from_slice(&[1.0, -2.0, 0.5, 30.0, 20.0, -25.0]);
    forward_kinematics(&model, &mut data);
    let v_com = |data: &Data| data.point_velocity_world(BodyId(0), &data.com_p_world(BodyId(0)));
    let spin = |data: &Data| kinetic(&model, data) - 0.25 * v_com(data).norm_squared();
    let (v_start, spin_start) = (v_com(&looked_back(&model, &data, H)), spin(&looked_back(&model, &data, H)));
    for _ in 0..180 {
        step(&model, &mut data, &settings(H, Vec3::zeros()), &mut StepReport::default());
    }
    let end = looked_back(&model, &data, H);
    assert!((v_com(&end) - v_start).norm() < 1e-11, "{}", v_com(&end));
    assert!((spin(&end) / spin_start - 1.0).abs() < 0.01, "{}", spin(&end) / spin_start);
}
