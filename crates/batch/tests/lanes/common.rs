//! Trees for the tests of batches.
#![allow(dead_code)]

use orchard_batch::{Batch, TreeWorld};
use orchard_fruit::place;
use orchard_geometry::Vec3;
use orchard_multibody::{Data, forward_kinematics};
use orchard_spec::{Purpose, Spec, Stream};
use orchard_treegen::grow;
use std::sync::Arc;

/// Grown trees: each its own topology.
pub fn grown(count: u32) -> Vec<TreeWorld> {
    let spec = Arc::new(Spec::paper());
    (0..count).map(|world| TreeWorld::grow(spec.clone(), 7, world).unwrap()).collect()
}

/// Trees of one topology with their own lengths and radii.
pub fn siblings(count: u32) -> Vec<TreeWorld> {
    let spec = Arc::new(Spec::paper());
    let grown = grow(&spec, 7, 0).unwrap();
    let fruit = place(&spec.fruit, &grown, 7, 0);
    (0..count)
        .map(|world| {
            let mut skeleton = grown.clone();
            let mut stream = Stream::new(11, world, Purpose::Test);
            for segment in &mut skeleton.segments {
                segment.length *= stream.uniform(0.9, 1.1);
                segment.radius *= stream.uniform(0.95, 1.05);
            }
            TreeWorld::new(spec.clone(), &skeleton, fruit.clone()).unwrap()
        })
        .collect()
}

/// Gives every joint of every world a random rate [rad/s].
pub fn kick(worlds: &mut [TreeWorld], rate: f64) {
    for (world, index) in worlds.iter_mut().zip(0..) {
        let mut stream = Stream::new(13, index, Purpose::Test);
        for v in &mut world.data_mut().v {
            *v = stream.uniform(-rate, rate);
        }
    }
}

/// Lifts fruit 0 of a world off its stem, `height` above the ground.
pub fn drop_fruit(world: &mut TreeWorld, height: f64) -> usize {
    let plant = world.plant().clone();
    let point = plant.fruit.points[0].index();
    let data = world.data_mut();
    data.tethered[point] = false;
    data.point_quadratic_drag[point] = plant.fruit.air_drag(0);
    data.groups[plant.fruit.colliders[0].index()] = plant.fruit.groups.loose;
    data.point_p_world[point].z = plant.fruit.fruit[0].radius + height;
    data.point_v_world[point] = Vec3::zeros();
    point
}

/// Gives a tree's trunk a rate [rad/s] just above the root, at the segment that is returned, so that it topples when broken there.
pub fn tip_over(world: &mut TreeWorld, rate: f64) -> usize {
    const SEGMENT: usize = 2;
    let plant = world.plant().clone();
    world.data_mut().v[plant.model.dofs(plant.tree.bodies[SEGMENT]).start] = rate;
    SEGMENT
}

/// A world's state in a batch, kinematics included.
pub fn state(batch: &Batch, worlds: &[TreeWorld], world: usize) -> Data {
    let mut data = worlds[world].data().clone();
    batch.store(world, &mut data);
    forward_kinematics(&worlds[world].plant().model, &mut data);
    data
}

/// Bits of a state.
pub fn bits(data: &Data) -> Vec<u64> {
    let points = data.point_p_world.iter().chain(&data.point_v_world).flat_map(|v| v.iter());
    let wood = data.q.iter().chain(&data.v).chain(&data.stiffness).chain(&data.damping);
    wood.chain(points).map(|x| x.to_bits()).collect()
}

/// Ends of the segments [m], world.
pub fn tips(world: &TreeWorld, data: &Data) -> Vec<Vec3> {
    let plant = world.plant();
    let tip = |id| {
        let p_tip = plant.model.body(id).inertia.p_com * 2.0;
        orchard_geometry::transform(data.x_world_body(id), &p_tip)
    };
    plant.tree.bodies.iter().map(|&id| tip(id)).collect()
}
