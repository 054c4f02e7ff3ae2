//! Forces on a world of the suite and on the same world of a batch.

use orchard_batch::{Stepper, TreeWorld};
use orchard_geometry::Vec3;

/// Pushes a segment of a world and of its batch.
pub fn push(
    world: &mut TreeWorld,
    stepper: &mut dyn Stepper,
    index: usize,
    segment: usize,
    [force, torque]: [Vec3; 2],
) {
    stepper.push(index, segment, force, torque).unwrap();
    let body = world.plant().tree.bodies[segment].index();
    world.data_mut().body_force_world[body] = force;
    world.data_mut().body_torque_world[body] = torque;
}

/// Pulls a fruit of a world and of its batch.
pub fn pull(world: &mut TreeWorld, stepper: &mut dyn Stepper, index: usize, fruit: usize, force: Vec3) {
    stepper.pull(index, fruit, force);
    let point = world.plant().fruit.points[fruit].index();
    world.data_mut().point_force_world[point] = force;
}
