//! Whole worlds on the device at hand, against the f64 worlds.

use std::sync::Arc;

use orchard_batch::TreeWorld;
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_world::{Planting, World};

use crate::testing::device;
use crate::{Gpu, GpuBatch, RobotBatch, WorldBatch};

/// A world in f64, and its tree alone, which a batch starts from.
fn world_of(spec: &Arc<Spec>, robot: &RobotModel, seed: u64) -> (World, TreeWorld) {
    let world = World::new(spec.clone(), Arc::new(robot.clone()), seed, 0).unwrap();
    let Planting { spec, skeleton, fruit, .. } = Planting::draw(spec, seed, 0, 0).unwrap();
    (world, TreeWorld::drawn(spec, &skeleton, fruit, seed, 0).unwrap())
}

fn batch_of(gpu: &Gpu, robot: &RobotModel, worlds: &[(World, TreeWorld)]) -> WorldBatch {
    let trees: Vec<_> = worlds.iter().map(|(_, tree)| tree.clone()).collect();
    let starts: Vec<_> = worlds.iter().map(|(world, _)| world.x_world_odom()).collect();
    WorldBatch::new(gpu, &trees, robot, &starts).unwrap()
}

/// A robot that touches nothing and its tree have the bits of each alone.
#[test]
fn without_contact_tree_and_robot_have_the_bits_of_each_alone() {
    const WORLDS: u64 = 4;
    let Some(gpu) = device() else { return };
    let (spec, robot) = (Arc::new(Spec::paper()), RobotModel::paper());
    let worlds: Vec<_> = (0..WORLDS).map(|seed| world_of(&spec, &robot, seed)).collect();
    let mut whole = batch_of(&gpu, &robot, &worlds);
    let trees: Vec<_> = worlds.iter().map(|(_, tree)| tree.clone()).collect();
    let mut alone = GpuBatch::new(&gpu, &trees).unwrap();
    let mut robots = RobotBatch::new(&gpu, &robot, &spec.sim, WORLDS as u32).unwrap();
    let mut command = robot.start_command();
    command.arm_q[1] += 0.2;
    command.base_velocity = [-0.3, 0.1, 0.2];
    for world in 0..WORLDS as usize {
        whole.command(world, &command).unwrap();
        robots.command(world, &command).unwrap();
    }
    whole.advance(12);
    alone.advance(12);
    robots.advance(12);
    for (index, (world, tree)) in worlds.iter().enumerate() {
        let (mut a, mut b) = (tree.data().clone(), tree.data().clone());
        whole.store_tree(index, &mut a).unwrap();
        alone.store(index, &mut b).unwrap();
        assert_eq!((a.q, a.v, a.point_p_world), (b.q, b.v, b.point_p_world), "tree {index}");
        let (mut a, mut b) = (world.data().clone(), world.data().clone());
        whole.store_robot(index, world.model(), world.handle(), &mut a).unwrap();
        robots.store(index, world.model(), world.handle(), &mut b).unwrap();
        assert_eq!((a.q, a.v), (b.q, b.v), "robot {index}");
        assert_eq!(whole.meeting(index).unwrap().most, 0);
    }
}
