//! Repeats differ in the robot's start pose and in nothing else; the trees of the official seeds grow, each in its own form.

use std::sync::Arc;

use orchard_camera::{Item, Label};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_tasks::protocol::Protocol;
use orchard_world::{Planting, World};

/// Everything but the robot: wood, leaves, fruit, stems, ground.
fn surroundings(world: &World) -> Vec<Item> {
    world.scene().items.into_iter().filter(|item| item.label != Label::Robot).collect()
}

#[test]
fn a_repeat_draws_another_start_pose_and_nothing_else() {
    let (spec, robot) = (Arc::new(Spec::paper()), Arc::new(RobotModel::paper()));
    for (seed, index) in [(20250704, 1), (20250706, 4)] {
        let repeat = |repeat| World::of_repeat(spec.clone(), robot.clone(), seed, index, repeat).unwrap();
        let worlds = [0, 1, 2].map(repeat);
        let plain = World::new(spec.clone(), robot.clone(), seed, index).unwrap();
        assert_eq!(plain.x_world_odom(), worlds[0].x_world_odom());
        assert_eq!(plain.snapshot().to_bytes(), worlds[0].snapshot().to_bytes());
        for (i, world) in worlds.iter().enumerate() {
            assert_eq!(world.skeleton(), plain.skeleton());
            assert_eq!(world.fruit_truth(), plain.fruit_truth());
            assert_eq!(world.fruit().fruit, plain.fruit().fruit, "stems, radii, masses");
            assert_eq!(world.reachable(), plain.reachable());
            assert_eq!(surroundings(world), surroundings(&plain));
            for other in &worlds[..i] {
                assert_ne!(world.x_world_odom(), other.x_world_odom());
                // Snapshots of one repeat are not taken for another's.
                assert!(world.check(&other.snapshot()).is_err());
            }
            // The start pose is within the protocol, like any other.
            let p = world.x_world_odom().translation.vector;
            let (low, high) = spec.episode.start.distance.si();
            assert!((low..=high).contains(&p.xy().norm()), "{p}");
        }
    }
}

/// A look at the trees alone: no robot, no episode.
#[test]
fn the_official_trees_grow_each_in_its_own_form() {
    let (protocol, spec) = (Protocol::paper(), Arc::new(Spec::paper()));
    let mut forms = Vec::new();
    for seed in protocol.official_seeds() {
        for world in 0..protocol.official_set().trees.get() {
            let planting = Planting::draw(&spec, seed, world, 0).unwrap();
            assert!(!planting.fruit.is_empty());
            let form: Vec<Option<usize>> = planting.skeleton.segments.iter().map(|s| s.parent).collect();
            assert!(!forms.contains(&form), "seed {seed}, tree {world}");
            forms.push(form);
        }
    }
    assert_eq!(forms.len(), 30);
}
