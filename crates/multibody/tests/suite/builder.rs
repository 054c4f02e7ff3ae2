//! Bad models give errors; indices are as documented.

use super::common;

use common::*;
use nalgebra::Unit;
use orchard_geometry::{Mat3, Pose, Shape, Vec3};
use orchard_multibody::*;

fn body(parent: Option<BodyId>, joint: JointKind) -> Body {
    Body {
        parent,
        joint,
        x_parent_joint: Pose::identity(),
        inertia: SpatialInertia {
            mass: 1.0,
            p_com: Vec3::new(0.1, 0.2, 0.3),
            i_com: Mat3::identity() * 0.01,
        },
    }
}

fn massless(parent: Option<BodyId>, joint: JointKind) -> Body {
    let inertia = SpatialInertia { mass: 0.0, p_com: Vec3::zeros(), i_com: Mat3::zeros() };
    Body { inertia, ..body(parent, joint) }
}

fn error(fill: impl FnOnce(&mut ModelBuilder)) -> ModelError {
    let mut builder = ModelBuilder::new();
    fill(&mut builder);
    builder.build().expect_err("a bad model")
}

fn tether(body: BodyId) -> Tether {
    Tether {
        body,
        p_body: Vec3::zeros(),
        offset_world: Vec3::zeros(),
        stiffness: 1.0,
        damping: 0.0,
        anchor_bias_world: Vec3::zeros(),
        reaction_cap: f64::INFINITY,
        turns: false,
    }
}

#[test]
fn bad_bodies_are_refused() {
    let forward = error(|b| {
        b.add_body(body(Some(BodyId(1)), JointKind::Universal));
        b.add_body(body(None, JointKind::Universal));
    });
    assert_eq!(forward, ModelError::Parent { body: 0, parent: 1 });
    let own = error(|b| {
        b.add_body(body(Some(BodyId(0)), JointKind::Universal));
    });
    assert_eq!(own, ModelError::Parent { body: 0, parent: 0 });
    let with = |change: fn(&mut Body)| {
        error(|b| {
            let mut bad = body(None, JointKind::Universal);
            change(&mut bad);
            b.add_body(bad);
        })
    };
    let changes: [fn(&mut Body); 8] = [
        |b| b.inertia.mass = -1.0,
        |b| b.inertia.mass = f64::NAN,
        |b| b.inertia.p_com.x = f64::INFINITY,
        |b| b.inertia.i_com[(0, 1)] = 0.1,
        |b| b.inertia.i_com[(2, 2)] = -0.1,
        |b| b.x_parent_joint.translation.vector.y = f64::NAN,
        |b| b.joint = JointKind::Hinge(Unit::new_unchecked(Vec3::zeros())),
        |b| b.joint = JointKind::Slide(Unit::new_unchecked(Vec3::repeat(f64::NAN))),
    ];
    for change in changes {
        assert!(matches!(with(change), ModelError::Value { what: "body", index: 0, .. }));
    }
}

#[test]
fn joints_without_inertia_are_refused_unless_something_heavy_hangs_on_them() {
    let bare = error(|b| {
        b.add_body(body(None, JointKind::Universal));
        b.add_body(massless(Some(BodyId(0)), JointKind::Hinge(Vec3::x_axis())));
    });
    assert_eq!(bare, ModelError::Singular { body: 1 });
    let collinear = error(|b| {
        b.add_body(massless(None, JointKind::Hinge(Vec3::x_axis())));
        b.add_body(body(Some(BodyId(0)), JointKind::Hinge(Vec3::x_axis())));
    });
    assert_eq!(collinear, ModelError::Singular { body: 0 });
    let mut builder = ModelBuilder::new();
    let turn = builder.add_body(massless(None, JointKind::Hinge(Vec3::z_axis())));
    let lift = builder.add_body(massless(Some(turn), JointKind::Slide(Vec3::z_axis())));
    builder.add_body(body(Some(lift), JointKind::Hinge(Vec3::x_axis())));
    assert!(builder.build().is_ok());
}

#[test]
fn bad_points_couplings_and_colliders_are_refused() {
    let weightless = error(|b| {
        b.add_point(PointBody { mass: 0.0, spin_inertia: f64::INFINITY, tether: None });
    });
    assert!(matches!(weightless, ModelError::Value { what: "point", .. }));
    let unknown = error(|b| {
        b.add_point(PointBody { mass: 1.0, spin_inertia: f64::INFINITY, tether: Some(tether(BodyId(3))) });
    });
    assert_eq!(unknown, ModelError::Reference { what: "point", index: 0, target: "body", id: 3 });
    let negative = error(|b| {
        let body = b.add_body(body(None, JointKind::Universal));
        let tether = Tether { stiffness: -1.0, ..tether(body) };
        b.add_point(PointBody { mass: 1.0, spin_inertia: f64::INFINITY, tether: Some(tether) });
    });
    assert!(matches!(negative, ModelError::Value { what: "point", .. }));
    let coupling = Coupling { dof_a: 0, dof_b: 2, ratio: 1.0, stiffness: 1.0, damping: 0.0 };
    let past_the_end = error(|b| {
        b.add_body(body(None, JointKind::Universal));
        b.add_coupling(coupling);
    });
    assert!(matches!(past_the_end, ModelError::Reference { what: "coupling", id: 2, .. }));
    let on_a_free_joint = error(|b| {
        b.add_body(body(None, JointKind::Free));
        b.add_coupling(coupling);
    });
    assert!(matches!(on_a_free_joint, ModelError::Value { what: "coupling", .. }));
    let collider = Collider {
        owner: Owner::World,
        shape: Shape::HalfSpace,
        x_owner_shape: Pose::identity(),
        groups: Groups::NONE,
        friction: 0.5,
        stiffness: 1e5,
    };
    let ball = Shape::Sphere { radius: -1.0 };
    let inside_out = error(|b| {
        b.add_collider(Collider { shape: ball, ..collider.clone() });
    });
    assert!(matches!(inside_out, ModelError::Value { what: "collider", .. }));
    let slippery = error(|b| {
        b.add_collider(Collider { friction: f64::NAN, ..collider.clone() });
    });
    assert!(matches!(slippery, ModelError::Value { what: "collider", .. }));
    let floating = error(|b| {
        b.add_collider(Collider { stiffness: 0.0, ..collider.clone() });
    });
    assert!(matches!(floating, ModelError::Value { what: "collider", .. }));
    let ownerless = error(|b| {
        b.add_collider(Collider { owner: Owner::Point(PointId(0)), ..collider.clone() });
    });
    assert!(matches!(ownerless, ModelError::Reference { what: "collider", target: "point", .. }));
}

#[test]
fn indices_follow_the_joints() {
    let model = random_tree(1, 13);
    let (mut nq, mut nv) = (0, 0);
    for id in model.body_ids() {
        let joint = model.body(id).joint;
        assert_eq!(model.qs(id), nq..nq + joint.nq());
        assert_eq!(model.dofs(id), nv..nv + joint.nv());
        for dof in model.dofs(id) {
            assert_eq!(model.body_of_dof(dof), id);
        }
        nq += joint.nq();
        nv += joint.nv();
    }
    assert_eq!((model.nq(), model.nv()), (nq, nv));
    let data = Data::new(&model);
    assert_eq!((data.q.len(), data.v.len()), (nq, nv));
}

#[test]
fn an_empty_model_steps() {
    let model = ModelBuilder::new().build().unwrap();
    step(&model, &mut Data::new(&model), &settings(0.01, GRAVITY), &mut StepReport::default());
}
