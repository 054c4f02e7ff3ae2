//! Controller `paper` with detector `paper-single`: the paper's own harvest cycle and perception in whole worlds.

use orchard_perception::DetectorConfig;
use orchard_picker::{Event, Kind};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_world::{Status, World};
use std::sync::Arc;

/// Two tuning seeds.
const SEEDS: [u64; 2] = [20250704, 20250705];
const SECONDS: f64 = 30.0;

#[test]
fn an_episode_makes_attempts() {
    let robot = Arc::new(RobotModel::paper());
    for seed in SEEDS {
        let spec = Arc::new(Spec::paper());
        let frames = (SECONDS * spec.sim.frame_rate.si()).round() as u32;
        let mut world = World::new(spec, robot.clone(), seed, 0).unwrap();
        let mut controller = Kind::Paper.controller(&robot, DetectorConfig::paper_single());
        for _ in 0..frames {
            let command = controller.act(&world.observe());
            world.step(&command);
        }
        assert_eq!(*world.status(), Status::Running);
        let events = &controller.record().events;
        let attempts = events.iter().filter(|e| matches!(e, Event::AttemptStarted { .. })).count();
        println!("seed {seed}: {attempts} attempts, {events:?}");
        assert!(attempts > 0, "seed {seed}");
    }
}
