//! Trees that come from files live in worlds like grown ones.

use std::sync::Arc;

use orchard_batch::TreeWorld;
use orchard_exchange::{json, mtg};
use orchard_fruit::place;
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_treegen::grow;
use orchard_world::World;

/// A tree written as MTG and as JSON and read again settles, hangs its fruit, and stays at rest for a second.
#[test]
fn imported_trees_come_to_rest_with_their_fruit() {
    let spec = Arc::new(Spec::paper());
    let grown = grow(&spec, 42, 0).unwrap();
    let from_mtg = mtg::read(&mtg::write(&grown)).unwrap();
    let from_json = json::read(&json::write(&grown)).unwrap();
    for tree in [from_mtg, from_json] {
        let skeleton = tree.into_skeleton(&spec, 42, 0);
        assert_eq!(skeleton.segments.len(), grown.segments.len());
        let fruit = place(&spec.fruit, &skeleton, 42, 0);
        assert!(!fruit.is_empty());
        let mut world = TreeWorld::new(spec.clone(), &skeleton, fruit).unwrap();
        let start = world.data().point_p_world.clone();
        for _ in 0..60 {
            assert!(world.step().is_empty());
        }
        let drift = start.iter().zip(&world.data().point_p_world).map(|(a, b)| (a - b).norm());
        assert!(drift.fold(0.0, f64::max) < 1e-9);
    }
}

/// A world around an imported tree is the world of the tree itself.
#[test]
fn a_world_takes_an_imported_tree() {
    let (spec, robot) = (Arc::new(Spec::paper()), Arc::new(RobotModel::paper()));
    let mut grown = World::new(spec.clone(), robot.clone(), 42, 0).unwrap();
    let file = json::write(grown.skeleton());
    let skeleton = json::read(&file).unwrap().into_skeleton(&spec, 42, 0);
    let mut imported = World::with_tree(spec, robot.clone(), skeleton, 42, 0, 0).unwrap();
    let hold = robot.start_command();
    for _ in 0..30 {
        grown.step(&hold);
        imported.step(&hold);
    }
    assert_eq!(imported.snapshot().to_bytes(), grown.snapshot().to_bytes());
}
