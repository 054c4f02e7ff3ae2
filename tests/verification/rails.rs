//! The three rails on applied forces: power fade from 8 m/s, brake above 25 m/s, impulse cap at 25 m/s within a
//! substep (30 and 60 rad/s for torques). Each acts where it should, and none acts on a link at rest.

use super::fixture::{GRAVITY, Wood, branch};
use orchard_geometry::Vec3;
use orchard_multibody::{
    Body, BodyId, Data, JointKind, Model, ModelBuilder, SpatialInertia, StepSettings, forward_kinematics,
};
use orchard_spec::Spec;
use orchard_spec::wood::RailsSpec;
use orchard_treephys::{rails::restrain, section};

const MASS: f64 = 0.01;

fn spec() -> RailsSpec {
    Spec::paper().wood.rails
}

/// A loose link that moves at `v` along x under a force along x.
fn loose(v: f64, force: f64) -> (Model, Data, StepSettings) {
    let mut builder = ModelBuilder::new();
    builder.add_body(Body {
        parent: None,
        joint: JointKind::Free,
        x_parent_joint: orchard_geometry::Pose::identity(),
        inertia: SpatialInertia { mass: MASS, ..section::capsule_inertia(850.0, 0.004, 0.2) },
    });
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    data.v[0] = v;
    data.body_force_world[0] = Vec3::new(force, 0.0, 0.0);
    forward_kinematics(&model, &mut data);
    let mut settings = Wood::new(branch(Vec3::x(), &[(1.0, 0.01)]), Spec::paper().wood).settings;
    settings.gravity = Vec3::zeros();
    (model, data, settings)
}

/// Force along x that the rails leave.
fn left(v: f64, force: f64) -> f64 {
    let (model, mut data, settings) = loose(v, force);
    restrain(&spec(), &model, &mut data, &settings, &[BodyId(0)]);
    data.body_force_world[0].x
}

/// Whole below 8 m/s, gone at 25 m/s, linear between; a force against the motion is never touched.
#[test]
fn power_fades_along_the_velocity() {
    for (v, kept) in [(0.0, 1.0), (7.9, 1.0), (16.5, 0.5), (25.0, 0.0)] {
        assert!((left(v, 0.1) - 0.1 * kept).abs() < 1e-12, "at {v} m/s");
    }
    for v in [5.0, 20.0] {
        assert_eq!(left(v, -0.1), -0.1);
    }
}

/// Above the limit the brake is `120 1/s * m * (v - 25 m/s)`.
#[test]
fn the_brake_slows_what_is_past_the_limit() {
    assert_eq!(left(24.9, 0.0), 0.0);
    assert!((left(30.0, 0.0) + 120.0 * MASS * 5.0).abs() < 1e-12);
    // With the force that the fade has taken off.
    assert!((left(30.0, 5.0) + 120.0 * MASS * 5.0).abs() < 1e-12);
}

/// 800 N on 10 g would reach 444 m/s within 1/180 s; capped, it reaches 25 m/s.
#[test]
fn the_impulse_is_capped_at_the_limit() {
    let expected = MASS * 25.0 * 180.0;
    assert!((left(0.0, 800.0) / expected - 1.0).abs() < 1e-9);
    let below = 0.99 * expected;
    assert_eq!(left(0.0, below), below);
}

/// A force far over the cap of a loose twig of its mass bends a live one to 95 % of its rupture moment and
/// stands: raised slowly, it is never changed by a bit, and the twig comes to the same equilibrium.
#[test]
fn no_rail_acts_on_static_loading() {
    let paper = Spec::paper().wood;
    let mut wood = Wood::new(branch(Vec3::x(), &[(0.08, 0.004), (0.05, 0.003), (0.02, 0.003)]), paper);
    wood.settings.gravity = Vec3::new(0.0, 0.0, -GRAVITY);
    // 95 % of what breaks the middle joint, with the arm of the straight twig.
    let force = Vec3::new(0.0, 0.0, -0.95 * wood.tree.rupture_moment[1] / 0.07);
    let tip = wood.tree.bodies[2].index();
    let cap = wood.model.bodies()[tip].inertia.mass * spec().speed_limit.si() / wood.settings.h;
    assert!(force.norm() > 2.0 * cap, "{} N is no trial for a cap of {cap} N", force.norm());
    let bodies = wood.tree.bodies.clone();
    let ramp = 360;
    for k in 1..=ramp + 360 {
        let part = f64::from(k.min(ramp)) / f64::from(ramp);
        wood.load_tip(2, force * part);
        let applied = (wood.data.body_force_world.clone(), wood.data.body_torque_world.clone());
        restrain(&spec(), &wood.model, &mut wood.data, &wood.settings, &bodies);
        assert_eq!(applied.0, wood.data.body_force_world, "substep {k}");
        assert_eq!(applied.1, wood.data.body_torque_world, "substep {k}");
        wood.step();
    }
    let bent = wood.p_tip(2).z;
    assert!(bent < -0.002, "bent to {bent} m only");
}
