//! Builds a world, drives the robot into the tree, and prints what happens to the wood and the fruit.

use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_world::truth::FruitState;
use orchard_world::{World, WorldError};
use std::sync::Arc;

fn main() -> Result<(), WorldError> {
    let (spec, robot) = (Arc::new(Spec::paper()), Arc::new(RobotModel::paper()));
    let mut world = World::new(spec, robot.clone(), 1, 0)?; // seed 1, world 0

    // Forward [m/s], left [m/s], yaw rate [rad/s].
    let command = Command { base_velocity: [1.0, 0.0, 0.0], ..robot.start_command() };
    for _ in 0..240 {
        let observation = world.observe(); // all that a controller may see
        if let Some(depth) = &observation.depth
            && world.frame() == 0
        {
            println!("depth image of {} x {} pixels", depth.width(), depth.height());
        }
        world.step(&command); // 1/60 s
    }

    for event in world.drain_events() {
        println!("{event:?}");
    }
    let on_tree = world.fruit_truth().iter().filter(|fruit| fruit.state == FruitState::OnTree).count();
    println!("{on_tree} of {} fruit on the tree", world.fruit().len());
    println!("impulse of the robot on the wood: {:.1} N s", world.wood_load().contact_impulse);
    Ok(())
}
