use std::sync::Arc;

use orchard_multibody::Owner;
use orchard_robot::RobotModel;
use orchard_spec::{Purpose, Spec, Stream};

use crate::World;

/// In a frame that may be lent the robot presses on nothing but tree and fruit, although set points jump at random and the arm is at its limits.
#[test]
fn a_robot_that_may_touch_itself_or_the_ground_stays_here() {
    let (spec, robot) = (Arc::new(Spec::paper()), Arc::new(RobotModel::paper()));
    let mut draws = Stream::new(1, 0, Purpose::Test);
    let (mut stayed, mut pressed) = (0, 0);
    for index in 0..2 {
        let mut world = World::new(spec.clone(), robot.clone(), 20_250_704, index).unwrap();
        let start = robot.start_command();
        let mut command = start;
        for frame in 0..600 {
            if frame % 12 == 0 {
                for k in 0..command.arm_q.len() {
                    command.arm_q[k] = start.arm_q[k] + draws.uniform(-2.5, 2.5);
                }
            }
            let stays = world.outlook(&command).stays.is_some();
            world.step(&command);
            let model = world.model();
            let is_robots = |id| {
                let collider = model.collider(id);
                matches!(collider.owner, Owner::Body(body) if world.handle().bodies.contains(&body))
            };
            let is_trees = |id| world.tree().colliders.contains(&id) || world.fruit().colliders.contains(&id);
            let presses = world.report().contacts.iter().any(|contact| {
                let pair = [contact.a, contact.b];
                contact.force_world.norm() > 0.0
                    && pair.into_iter().any(is_robots)
                    && !pair.into_iter().any(is_trees)
            });
            assert!(stays || !presses, "world {index}, frame {frame}");
            (stayed, pressed) = (stayed + u32::from(stays), pressed + u32::from(presses));
        }
    }
    assert!(pressed > 10 && stayed < 1150, "{pressed} {stayed}");
}
