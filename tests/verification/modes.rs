//! The paper's other models of a tree: welded joints, and stiffness by branch level.

use super::fixture::{GRAVITY, Wood};
use orchard_geometry::{Vec3, math};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_spec::wood::JointLaw;
use orchard_treegen::grow;
use orchard_world::{Status, World};
use std::sync::Arc;

/// A rigid tree has no joint coordinate: no load moves a segment by a bit, and nothing breaks.
#[test]
fn a_rigid_tree_stands_where_it_grew() {
    let mut spec = Spec::paper();
    spec.wood.rigid = true;
    let mut world = World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 42, 0).unwrap();
    let tree = world.tree().clone();
    assert!(tree.bodies.iter().all(|&b| world.model().dofs(b).is_empty()));
    let places = |w: &World| tree.bodies.iter().map(|&b| *w.data().x_world_body(b)).collect::<Vec<_>>();
    let grown = places(&world);
    for (pose, segment) in grown.iter().zip(&world.skeleton().segments) {
        // Poses are products along the chain: round-off.
        assert!((pose.translation.vector - segment.p_base_world).norm() < 1e-12);
    }
    let hold = RobotModel::paper().start_command();
    for &body in &tree.bodies {
        world.data_mut().body_force_world[body.index()] = Vec3::new(300.0, -200.0, -500.0);
    }
    for _ in 0..60 {
        world.step(&hold);
    }
    assert_eq!(*world.status(), Status::Running);
    assert!(places(&world) == grown);
    assert!(world.rupture().breaks().is_empty());
}

/// `K = k0 exp(-decay level)`, level the branch order: one figure a level, whatever the section. A grown tree
/// settles under it.
#[test]
fn the_per_level_law_falls_exponentially() {
    let mut spec = Spec::paper();
    spec.wood.joint_law = JointLaw::PerLevel;
    let skeleton = grow(&spec, 42, 0).unwrap();
    let (k0, decay) = (spec.wood.per_level_stiffness.si(), spec.wood.per_level_decay.si());
    let mut wood = Wood::new(skeleton, spec.wood);
    for (segment, stiffness) in wood.skeleton.segments.iter().zip(&wood.tree.stiffness) {
        let expected = k0 * math::exp(-decay * f64::from(segment.order));
        assert!((stiffness / expected - 1.0).abs() < 1e-12, "order {}", segment.order);
    }
    wood.settings.gravity = Vec3::new(0.0, 0.0, -GRAVITY);
    wood.settle();
    let sag = (0..wood.tree.len())
        .map(|i| (wood.p_tip(i) - wood.skeleton.segments[i].p_tip_world()).norm())
        .fold(0.0, f64::max);
    assert!(sag > 0.0 && sag < 0.2, "{sag} m");
}
