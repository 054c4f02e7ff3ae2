//! Leaves as the camera sees them.

use orchard_camera::Label;
use orchard_geometry::{Pose, Vec3};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_world::World;
use std::sync::Arc;

/// Poses of all wood and all blades in the scene, by segment and by leaf.
fn poses(world: &World) -> (Vec<Pose>, Vec<Pose>) {
    let scene = world.scene();
    let of = |label| {
        let mut items: Vec<_> = scene.items.iter().filter(|item| item.label == label).collect();
        items.sort_by_key(|item| item.instance);
        assert!(items.iter().enumerate().all(|(i, item)| item.instance as usize == i), "one item for each");
        items.iter().map(|item| item.x_world_item).collect::<Vec<_>>()
    };
    (of(Label::Wood), of(Label::Leaf))
}

/// Every blade keeps its pose on its segment, while limbs bend under a load and after one has broken and fallen.
#[test]
fn every_blade_moves_with_its_segment() {
    let robot = Arc::new(RobotModel::paper());
    let mut world = World::new(Arc::new(Spec::paper()), robot.clone(), 17, 0).unwrap();
    let (wood, leaves) = poses(&world);
    assert_eq!((wood.len(), leaves.len()), (world.skeleton().segments.len(), world.skeleton().leaves.len()));
    assert!(leaves.len() > 100, "{} leaves", leaves.len());
    let owner: Vec<usize> = world.skeleton().leaves.iter().map(|leaf| leaf.segment).collect();
    let on_segment: Vec<Pose> = leaves.iter().zip(&owner).map(|(x, &s)| wood[s].inverse() * x).collect();
    // How far the blades of a part of the tree have moved: the least and the most of them.
    let check = |world: &World, is_moved: &dyn Fn(usize) -> bool| {
        let (wood, now) = poses(world);
        let mut way = (f64::INFINITY, 0.0_f64);
        for (i, x) in now.iter().enumerate() {
            let off = on_segment[i].inverse() * (wood[owner[i]].inverse() * x);
            // Round-off of products of poses some metres long.
            assert!(off.translation.vector.norm() < 1e-13 && off.rotation.angle() < 1e-7, "leaf {i}: {off}");
            if is_moved(owner[i]) {
                let moved = (x.translation.vector - leaves[i].translation.vector).norm();
                way = (way.0.min(moved), way.1.max(moved));
            }
        }
        way
    };

    let segments = world.skeleton().segments.clone();
    let limb = segments.iter().position(|s| s.order == 1).unwrap();
    let is_on_limb = |mut segment: usize| loop {
        match segments[segment].parent {
            _ if segment == limb => return true,
            Some(parent) => segment = parent,
            None => return false,
        }
    };
    let tip = (0..segments.len()).rfind(|&s| is_on_limb(s) && segments[s].order == 1).unwrap();
    for _ in 0..60 {
        let body = world.tree().bodies[tip].index();
        world.data_mut().body_force_world[body] = Vec3::new(0.0, 0.0, -25.0);
        world.step(&robot.start_command());
    }
    let (_, most) = check(&world, &is_on_limb);
    assert!(most > 0.01, "the limb bends by {most} m");

    let body = world.tree().bodies[tip].index();
    world.data_mut().body_force_world[body] = Vec3::zeros();
    world.break_branch(limb);
    for _ in 0..90 {
        world.step(&robot.start_command());
    }
    assert!((0..segments.len()).filter(|&s| is_on_limb(s)).all(|s| world.rupture().is_debris(s)));
    let (_, most) = check(&world, &is_on_limb);
    assert!(most > 0.3, "the limb has fallen {most} m");
}
