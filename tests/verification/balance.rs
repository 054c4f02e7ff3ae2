//! Balances of momentum and energy.
//!
//! A floating articulation: `dp/dt = sum F`, `dL/dt = sum r x F`; wood with a clamped base:
//! `T + V = const` without damping, `d(T + V)/dt = F v - D v^2` with a load and damping.

use super::fixture::{GRAVITY, Wood, bare_wood, branch};
use orchard_geometry::{Mat3, Pose, Rotation, Vec3};
use orchard_multibody::{
    Body, BodyId, Data, Integrator, JointKind, Model, ModelBuilder, SpatialInertia, forward_kinematics, step,
};
use orchard_spec::wood::JointLaw;

fn floating_chain() -> (Model, Data) {
    let mut builder = ModelBuilder::new();
    for k in 0..4 {
        builder.add_body(Body {
            parent: (k > 0).then(|| BodyId(k - 1)),
            joint: if k == 0 { JointKind::Free } else { JointKind::Universal },
            x_parent_joint: Pose::from_parts(
                Vec3::new(0.0, 0.0, if k == 0 { 0.0 } else { 0.3 }).into(),
                Rotation::from_scaled_axis(Vec3::new(0.3, 0.2, 0.1) * f64::from(k)),
            ),
            inertia: SpatialInertia {
                mass: 0.5,
                p_com: Vec3::new(0.02, 0.0, 0.15),
                i_com: Mat3::from_diagonal(&Vec3::new(4e-3, 5e-3, 2e-3)),
            },
        });
    }
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    for (dof, v) in data.v.iter_mut().enumerate() {
        *v = [0.4, -0.3, 0.5, 1.0, -2.0, 1.5, 2.0][dof % 7];
    }
    for dof in 6..model.nv() {
        data.stiffness[dof] = 5.0;
    }
    forward_kinematics(&model, &mut data);
    (model, data)
}

/// Linear momentum, and angular momentum about the world's origin.
fn momentum(model: &Model, data: &Data) -> (Vec3, Vec3) {
    let (mut linear, mut angular) = (Vec3::zeros(), Vec3::zeros());
    for id in model.body_ids() {
        let inertia = &model.body(id).inertia;
        let com = data.com_p_world(id);
        let p = data.point_velocity_world(id, &com) * inertia.mass;
        let turn = data.x_world_body(id).rotation.to_rotation_matrix();
        let spin = turn.matrix() * inertia.i_com * turn.matrix().transpose() * data.velocity(id).angular;
        linear += p;
        angular += com.cross(&p) + spin;
    }
    (linear, angular)
}

/// Drift of the momentum from its balance over 0.5 s under a constant force on one link \[N s, N m s\].
fn momentum_error(h: f64) -> (f64, f64) {
    let (model, mut data) = floating_chain();
    let force = Vec3::new(0.5, -1.0, 2.0);
    data.body_force_world[2] = force;
    let mut settings = Wood::cantilever(1, bare_wood(JointLaw::Paper, 0.0)).settings;
    settings.integrator = Integrator::ImplicitMidpoint;
    settings.h = h;
    let (p0, l0) = momentum(&model, &data);
    let mut moment = Vec3::zeros();
    let steps = (0.5 / h).round() as u32;
    for _ in 0..steps {
        let before = data.com_p_world(BodyId(2));
        step(&model, &mut data, &settings, &mut Default::default());
        moment += ((before + data.com_p_world(BodyId(2))) * (0.5 * h)).cross(&force);
    }
    let (p, l) = momentum(&model, &data);
    ((p - p0 - force * 0.5).norm(), (l - l0 - moment).norm())
}

/// Momentum and angular momentum follow the applied force, with the second order of the midpoint rule:
/// a quarter of the error at half the step (0.15 of the order for the next term).
#[test]
fn momentum_follows_the_applied_force() {
    let (coarse, fine) = (momentum_error(2e-3), momentum_error(1e-3));
    println!("momentum error {coarse:?} {fine:?}");
    for (coarse, fine) in [(coarse.0, fine.0), (coarse.1, fine.1)] {
        let ratio = coarse / fine;
        assert!((3.6..4.4).contains(&ratio), "{coarse} {fine}");
    }
}

/// A branch bent by 10 degrees and released: the midpoint rule keeps its energy to second order.
#[test]
fn undamped_wood_keeps_its_energy() {
    let drift = |h: f64| {
        let mut wood = Wood::new(branch(Vec3::x(), &[(0.2, 0.004); 4]), bare_wood(JointLaw::Corrected, 0.0));
        wood.settings.gravity = Vec3::new(0.0, 0.0, -GRAVITY);
        wood.settings.integrator = Integrator::ImplicitMidpoint;
        wood.settings.h = h;
        for (dof, q) in wood.data.q.iter_mut().enumerate() {
            *q = [0.05, 0.03][dof % 2];
        }
        forward_kinematics(&wood.model, &mut wood.data);
        let (start, mut worst) = (wood.energy(), 0.0_f64);
        for _ in 0..(1.0 / h).round() as u32 {
            wood.step();
            worst = worst.max((wood.energy() - start).abs());
        }
        worst
    };
    let (coarse, fine) = (drift(1e-3), drift(5e-4));
    println!("energy drift {coarse} {fine} J");
    assert!((3.0..5.0).contains(&(coarse / fine)), "{coarse} {fine}");
}

/// Work of the load = gain of energy + what the dampers take, `sum d v^2`, each integrated at the middle of the
/// steps: exact for the linear part of the rule, the rest of second order.
#[test]
fn work_is_stored_or_dissipated() {
    let residual = |h: f64| {
        let mut wood = Wood::new(branch(Vec3::x(), &[(0.2, 0.004); 4]), bare_wood(JointLaw::Paper, 0.02));
        wood.settings.gravity = Vec3::new(0.0, 0.0, -GRAVITY);
        wood.settings.integrator = Integrator::ImplicitMidpoint;
        wood.settings.h = h;
        wood.settle();
        let start = wood.energy();
        let body = wood.tree.bodies[3];
        let force = Vec3::new(0.0, 0.4, -0.3);
        wood.data.body_force_world[body.index()] = force;
        let (mut work, mut lost) = (0.0, 0.0);
        for _ in 0..(0.5 / h).round() as u32 {
            let (com, q) = (wood.data.com_p_world(body), wood.data.q.clone());
            wood.step();
            work += force.dot(&(wood.data.com_p_world(body) - com));
            let rates = wood.data.q.iter().zip(&q).map(|(now, before)| (now - before) / h);
            lost += rates.zip(&wood.data.damping).map(|(v, d)| d * v * v * h).sum::<f64>();
        }
        assert!(lost > 0.1 * work && work > 0.0, "{lost} of {work} J");
        (work - lost - (wood.energy() - start)).abs() / work
    };
    let (coarse, fine) = (residual(1e-3), residual(5e-4));
    println!("energy balance {coarse} {fine}");
    assert!(fine < 1e-5 && coarse / fine > 3.0, "{coarse} {fine}");
}
