//! A sphere rigid on a stem that hangs from two hinges swings as a compound pendulum:
//!
//! `f = sqrt(g L / (L^2 + 2/5 r^2)) / 2 pi`, L from the hinges to the centre: 1.86 Hz for r = 37.5 mm on 25 mm.

use super::fixture::GRAVITY;
use super::frequencies::rising_zeros;
use nalgebra::Unit;
use orchard_geometry::{Mat3, Pose, Vec3};
use orchard_multibody::{
    Body, ContactPath, Data, Integrator, JointKind, ModelBuilder, Solver, SpatialInertia, StepReport,
    StepSettings, step,
};
use std::f64::consts::TAU;

const RADIUS: f64 = 0.0375;
const STEM: f64 = 0.025;
const MASS: f64 = 0.16;

/// Frequency of a small swing about the second hinge, y, or, with `across`, about the first, x.
fn frequency(integrator: Integrator, across: bool) -> f64 {
    let arm = STEM + RADIUS;
    let ball = Mat3::identity() * (0.4 * MASS * RADIUS * RADIUS);
    let massless = SpatialInertia { mass: 0.0, p_com: Vec3::zeros(), i_com: Mat3::zeros() };
    let mut builder = ModelBuilder::new();
    let hinge = |parent, axis: Vec3, inertia| Body {
        parent,
        joint: JointKind::Hinge(Unit::new_normalize(axis)),
        x_parent_joint: Pose::identity(),
        inertia,
    };
    let ring = builder.add_body(hinge(None, Vec3::x(), massless));
    let apple = SpatialInertia { mass: MASS, p_com: Vec3::new(0.0, 0.0, -arm), i_com: ball };
    builder.add_body(hinge(Some(ring), Vec3::y(), apple));
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    let dof = usize::from(!across);
    // 0.05 rad lengthens the period by 1/16 of its square, 0.02 %.
    data.q[dof] = 0.05;
    let settings = StepSettings {
        h: 1.0 / 180.0,
        gravity: Vec3::new(0.0, 0.0, -GRAVITY),
        contact_dissipation_time: 0.01,
        contact_margin: 0.0,
        integrator,
        solver: Solver::default(),
        contact_path: ContactPath::default(),
    };
    let mut signal = Vec::new();
    for _ in 0..180 * 8 {
        step(&model, &mut data, &settings, &mut StepReport::default());
        signal.push(data.q[dof]);
    }
    let zeros = rising_zeros(&signal);
    (zeros.len() - 1) as f64 / ((zeros[zeros.len() - 1] - zeros[0]) * settings.h)
}

/// Both hinges, both schemes, within 3 %.
#[test]
fn a_fruit_on_its_stem_swings_at_its_frequency() {
    let arm = STEM + RADIUS;
    let exact = (GRAVITY * arm / (arm * arm + 0.4 * RADIUS * RADIUS)).sqrt() / TAU;
    assert!((exact - 1.86).abs() < 0.005);
    for integrator in [Integrator::LinearlyImplicitEuler, Integrator::ImplicitMidpoint] {
        for across in [false, true] {
            let measured = frequency(integrator, across);
            assert!((measured / exact - 1.0).abs() < 0.03, "{integrator:?}: {measured} Hz against {exact}");
        }
    }
}
