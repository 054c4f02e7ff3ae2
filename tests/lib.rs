//! Fixtures of the cross-crate suites: an episode of a world under a picker, with its result, and a pick by
//! script; the bits of a state.

mod bits;
mod scripted;

pub use bits::{fingerprint, state_hash};
pub use scripted::{Pick, scripted_pick, watched_pick};

use orchard_perception::DetectorConfig;
use orchard_picker::{BaselinePicker, Controller, PickerConfig};
use orchard_robot::{Observation, RobotModel};
use orchard_spec::Spec;
use orchard_world::truth::FruitState;
use orchard_world::{Status, World, WorldEvent};
use std::sync::Arc;

/// Half a second: fingers that press from the sides of a moving hand can push a fruit off its stem without holding it.
pub const CARRIED: u32 = 30;

/// Result of an episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Story {
    /// Everything that happened.
    pub events: Vec<WorldEvent>,
    /// Fruit whose stem gave way between both fingers, and that were still there [`CARRIED`] frames later.
    pub picked: usize,
    /// Final state of each fruit.
    pub states: Vec<FruitState>,
    /// Largest speed of any robot joint \[rad/s or m/s\].
    pub top_speed: f64,
}

impl Story {
    /// Fruit in the bucket at the end.
    pub fn deposited(&self) -> usize {
        self.states.iter().filter(|f| **f == FruitState::Deposited).count()
    }

    /// Stems that gave way for whatever reason: the hand, or the arm that pushed a neighbour off.
    pub fn detached(&self) -> usize {
        self.events.iter().filter(|e| matches!(e, WorldEvent::FruitDetached { .. })).count()
    }

    /// Times that both fingers closed on a fruit.
    pub fn gripped(&self) -> usize {
        self.events.iter().filter(|e| matches!(e, WorldEvent::FruitGripped { .. })).count()
    }
}

/// Runs the baseline picker; `tamper` may alter its observations.
pub fn harvest(
    spec: &Spec,
    robot: &RobotModel,
    picker: PickerConfig,
    seed: u64,
    world: u32,
    seconds: f64,
    mut tamper: impl FnMut(&mut Observation),
) -> Story {
    let mut world = World::new(Arc::new(spec.clone()), Arc::new(robot.clone()), seed, world)
        .unwrap_or_else(|e| panic!("seed {seed}, world {world}: {e}"));
    let mut picker = BaselinePicker::new(robot, DetectorConfig::paper(), picker);
    let frames = (seconds * spec.sim.frame_rate.si()).round() as u32;
    let mut story = Story { events: Vec::new(), picked: 0, states: Vec::new(), top_speed: 0.0 };
    // Fruit that came off between the fingers, and how many frames they have been held since.
    let mut carried: Vec<(usize, u32)> = Vec::new();
    for _ in 0..frames {
        let mut observation = world.observe();
        tamper(&mut observation);
        let command = picker.act(&observation);
        world.step(&command);
        let arm = observation.arm_v.iter().chain(&observation.base_velocity);
        story.top_speed = arm.fold(story.top_speed, |top, v| top.max(v.abs()));
        for event in world.drain_events() {
            if let WorldEvent::FruitDetached { fruit, .. } = event {
                carried.push((fruit, 0));
            }
            story.events.push(event);
        }
        carried.retain(|(fruit, _)| world.is_held(*fruit));
        for (_, frames) in &mut carried {
            *frames += 1;
            story.picked += usize::from(*frames == CARRIED);
        }
        assert_eq!(*world.status(), Status::Running);
    }
    story.states = world.fruit_truth().iter().map(|f| f.state).collect();
    story
}
