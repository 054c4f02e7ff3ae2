//! Worlds with a fruit off its stem, and one at the suction cup of a robot.

use std::sync::Arc;

use orchard_geometry::{Vec3, transform};
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_world::World;

/// The fruit.
pub const FRUIT: usize = 0;
/// Depth by which the lip is pressed into it [m].
const DEPTH: f64 = 0.3e-3;

/// A world in which the fruit has come off its stem, and the command that holds the robot's start.
pub fn off_stem(spec: &Arc<Spec>, robot: &RobotModel) -> (World, Command) {
    let mut world = World::new(spec.clone(), Arc::new(robot.clone()), 3, 0).unwrap();
    let point = world.fruit().points[FRUIT].index();
    let command = robot.start_command();
    while world.data().tethered[point] {
        world.data_mut().point_force_world[point] = Vec3::new(0.0, 0.0, 60.0);
        world.step(&command);
    }
    (world, command)
}

/// A world in which the lip of a robot's cup lies on the fruit, whose weight a force bears, with the valve closed.
pub fn laid_on_cup(spec: &Arc<Spec>, robot: &RobotModel) -> (World, Command) {
    let (mut world, command) = off_stem(spec, robot);
    let cup = world.handle().cup.clone().unwrap();
    let point = world.fruit().points[FRUIT].index();
    let fruit = &world.fruit().fruit[FRUIT];
    let (reach, mass) = (fruit.radius + cup.half_thickness - DEPTH, fruit.mass);
    let p_lip = Vec3::new(0.0, 0.0, (reach * reach - cup.lip_radius * cup.lip_radius).sqrt());
    let x_world_lip = world.data().x_world_body(world.handle().wrist()) * cup.x_wrist_lip;
    let data = world.data_mut();
    data.point_force_world[point] = Vec3::z() * (mass * spec.sim.gravity.si());
    data.point_p_world[point] = transform(&x_world_lip, &p_lip);
    data.point_v_world[point] = Vec3::zeros();
    data.point_w_world[point] = Vec3::zeros();
    // The lip takes the fruit over.
    world.step(&command);
    (world, command)
}
