//! The robot driven into trees at 1.1 and 3 m/s.

use orchard_multibody::Owner;
use orchard_robot::{PAPER_URDF, RobotConfig, RobotModel};
use orchard_spec::Spec;
use orchard_world::{Status, World};
use rayon::prelude::*;
use std::sync::Arc;

/// The paper's robot with another top speed [m/s], and an acceleration that reaches it at once.
fn robot(speed: f64) -> RobotModel {
    let mut config = RobotConfig::paper();
    config.base.speed_max = config.base.speed_max.with_value(speed).unwrap();
    config.base.acceleration_max = config.base.acceleration_max.with_value(50.0).unwrap();
    RobotModel::from_urdf(PAPER_URDF, &config).unwrap()
}

/// Frames of a ram of 4 s in which the robot overlaps whole wood. The world must run on: it stops at the first
/// value that is not finite and at the first body that leaves its box of 10 m.
fn ram(speed: f64, seed: u64) -> usize {
    let robot = robot(speed);
    let mut world = World::new(Arc::new(Spec::paper()), Arc::new(robot.clone()), seed, 0).unwrap();
    let mut command = robot.start_command();
    command.base_velocity = [speed, 0.0, 0.0];
    let mut touched = 0;
    for frame in 0..240 {
        world.step(&command);
        assert_eq!(*world.status(), Status::Running, "{speed} m/s, seed {seed}, frame {frame}");
        let is_wood = |id| match world.model().collider(id).owner {
            Owner::Body(body) => world.tree().bodies.contains(&body),
            _ => false,
        };
        let contacts = &world.report().contacts;
        touched += usize::from(contacts.iter().any(|c| c.gap < 0.0 && (is_wood(c.a) || is_wood(c.b))));
    }
    touched
}

/// 20 random canopies at the base's top speed and at 3 m/s: every ram meets wood, and every state stays finite.
/// How deep the contact lets the robot sink into the wood is not judged here.
#[test]
fn rams_through_twenty_canopies_stay_finite() {
    for speed in [1.1, 3.0] {
        (0..20_u64).into_par_iter().for_each(|seed| {
            assert!(ram(speed, seed) > 0, "{speed} m/s, seed {seed}: the robot meets nothing");
        });
    }
}
