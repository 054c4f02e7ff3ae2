//! Runs a controller on one observation: a robot at rest that sees an empty depth image.
use orchard_geometry::{DepthImage, Intrinsics};
use orchard_perception::DetectorConfig;
use orchard_picker::{Controller, Kind};
use orchard_robot::{Observation, RobotModel};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let robot = RobotModel::paper();
    let mut controller = Kind::named("baseline")?.controller(&robot, DetectorConfig::paper());

    let intrinsics = Intrinsics::from_vertical_fov(192, 144, 75_f64.to_radians());
    let observation = Observation {
        time: 0.0,
        arm_q: robot.start_command().arm_q,
        arm_v: [0.0; 7].into(),
        arm_torque: [0.0; 7].into(),
        finger_q: [0.04; 2],
        finger_force: [0.0; 2],
        cup_pressure: 0.0,
        base_pose: [0.0; 3],
        base_height: 0.0,
        base_velocity: [0.0; 3],
        depth: Some(DepthImage::filled(192, 144, 0.0)),
        colour: None,
        depth_time: 0.0,
        intrinsics,
        pictures: None,
    };
    let command = controller.act(&observation);
    println!("base {:?}, arm {:.3?}", command.base_velocity, command.arm_q);
    println!("{} event(s) recorded", controller.record().events.len());
    assert_eq!(command.base_velocity, [0.0; 3], "without sight the base stands still");
    Ok(())
}
