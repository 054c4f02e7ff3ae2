use super::*;
use crate::rules::PlayRules;
use orchard_scenario::Scenario;
use orchard_world::World;

fn jogged(robot: &str, wish: Wish, frames: u32) -> (World, Pose, Pose) {
    let scenario = Scenario::of(&[("robot", robot)]).unwrap();
    let mut world = scenario.world(20250704, 0, 0).unwrap();
    let mut jog = Jog::begin(world.robot(), &world.sense(), &PlayRules::v1().jog);
    jog.wish = wish;
    let x_base_tcp = |world: &World| {
        world.handle().x_world_base(world.data()).inverse() * world.handle().x_world_tcp(world.data())
    };
    let start = x_base_tcp(&world);
    for _ in 0..frames {
        let command = jog.act(world.robot(), world.spec().sim.frame());
        world.step(&command);
    }
    let end = x_base_tcp(&world);
    (world, start, end)
}

/// Every robot's hand goes where it is told, straight, and keeps its direction.
#[test]
fn the_hand_of_every_robot_follows() {
    for robot in orchard_scenario::robots() {
        let up = Wish { hand: [0.0, 0.0, 0.5], ..Wish::default() };
        let (_, start, end) = jogged(robot, up, 60);
        let moved = end.translation.vector - start.translation.vector;
        let turned = start.rotation.angle_to(&end.rotation);
        assert!(moved.z > 0.06 && moved.xy().norm() < 0.03 && turned < 0.1, "{robot}: {moved} {turned}");
    }
}

/// 0.4 m/s for 2 s, less the rise.
#[test]
fn the_base_drives_and_turns() {
    let forward = Wish { base: [1.0, 0.0, 0.0], ..Wish::default() };
    let (still, ..) = jogged("ridgeback-fr3", Wish::default(), 60);
    let base = |world: &World| world.handle().x_world_base(world.data());
    let start = base(&still);
    let back = Wish { base: [-1.0, 0.0, 0.0], ..Wish::default() };
    let way = |wish| (start.inverse() * base(&jogged("ridgeback-fr3", wish, 60).0)).translation.vector.x;
    assert!((way(back) + 0.36).abs() < 0.05 && way(forward) > 0.2, "{} {}", way(back), way(forward));
    let turn = Wish { base: [0.0, 0.0, 1.0], ..Wish::default() };
    let (turned, ..) = jogged("ridgeback-fr3", turn, 60);
    let angle = start.rotation.angle_to(&base(&turned).rotation);
    assert!((0.3..0.6).contains(&angle), "{angle}");
}

/// At the edge of its reach the hand stops; it comes back at once when told. What is no number counts as no wish.
#[test]
fn beyond_the_reach_the_hand_waits() {
    let robot = orchard_robot::RobotModel::paper();
    let scenario = Scenario::of(&[]).unwrap();
    let world = scenario.world(20250704, 0, 0).unwrap();
    let mut jog = Jog::begin(&robot, &world.sense(), &PlayRules::v1().jog);
    let dt = 1.0 / 60.0;
    jog.wish = Wish { hand: [1.0, f64::NAN, 7.0], ..Wish::default() };
    let far = (0..600).map(|_| jog.act(&robot, dt)).last().unwrap();
    assert!(far.arm_q.iter().chain(far.arm_v.iter()).all(|x| x.is_finite()));
    let reached = robot.kinematics().tcp(&far.arm_q.vector()).translation.vector;
    assert!((jog.x_base_tcp().translation.vector - reached).norm() <= PlayRules::v1().jog.lead.si() + 1e-9);
    jog.wish = Wish { hand: [-1.0, 0.0, 0.0], ..Wish::default() };
    let back = (0..60).map(|_| jog.act(&robot, dt)).last().unwrap();
    assert!(robot.kinematics().tcp(&back.arm_q.vector()).translation.vector.x < reached.x - 0.05);
}

#[test]
fn a_closed_hand_shuts_and_draws_air() {
    let (world, ..) = jogged("ridgeback-fr3", Wish { closes: true, ..Wish::default() }, 60);
    assert!(world.sense().finger_q[0] < 2e-3);
    let robot = world.robot();
    let mut jog = Jog::begin(robot, &world.sense(), &PlayRules::v1().jog);
    assert!(jog.act(robot, 1.0 / 60.0).finger_q > 0.02);
    jog.wish.closes = true;
    assert_eq!(jog.act(robot, 1.0 / 60.0).vacuum, 1.0);
}
