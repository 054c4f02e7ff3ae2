//! The picker picks by contact and by its sensors alone: take either away and nothing is picked.

use orchard_geometry::Image;
use orchard_picker::PickerConfig;
use orchard_robot::{PAPER_URDF, RobotConfig, RobotModel};
use orchard_spec::Spec;
use orchard_tests::{Story, harvest};
use rayon::prelude::*;

/// Seed whose trees the controls share. A tuning seed: the picker is known to pick here.
const SEED: u64 = 20250704;
const WORLDS: u32 = 2;
const SECONDS: f64 = 40.0;

fn stories(spec: &Spec, robot: &RobotConfig, blind: bool) -> Vec<Story> {
    let robot = RobotModel::from_urdf(PAPER_URDF, robot).expect("the preset's robot");
    (0..WORLDS)
        .into_par_iter()
        .map(|world| {
            harvest(spec, &robot, PickerConfig::paper(), SEED, world, SECONDS, |observation| {
                if let (true, Some(depth)) = (blind, &mut observation.depth) {
                    *depth = Image::filled(depth.width(), depth.height(), 0.0);
                }
            })
        })
        .collect()
}

fn total(stories: &[Story], count: impl Fn(&Story) -> usize) -> usize {
    stories.iter().map(count).sum()
}

/// The control of the controls: with nothing taken away, fruit lands in the bucket.
#[test]
fn the_sound_robot_deposits_fruit() {
    let stories = stories(&Spec::paper(), &RobotConfig::paper(), false);
    assert!(total(&stories, Story::deposited) > 0);
}

#[test]
fn without_finger_friction_nothing_is_picked() {
    let mut robot = RobotConfig::paper();
    robot.friction.finger = robot.friction.finger.with_value(0.0).unwrap();
    let stories = stories(&Spec::paper(), &robot, false);
    assert!(total(&stories, Story::gripped) > 0, "the fingers never closed on a fruit: nothing was tried");
    assert_eq!(total(&stories, Story::deposited), 0);
}

/// Two fingers of 5 N hold 10 N by friction at most; the weakest stem takes 1.2 * 14 N.
#[test]
fn with_weak_fingers_nothing_is_detached() {
    let mut robot = RobotConfig::paper();
    robot.finger.force_max = robot.finger.force_max.with_value(5.0).unwrap();
    let stories = stories(&Spec::paper(), &robot, false);
    assert!(total(&stories, Story::gripped) > 0, "the fingers never closed on a fruit: nothing was tried");
    assert_eq!(total(&stories, Story::detached), 0);
}

#[test]
fn a_blind_camera_picks_nothing_and_stays_safe() {
    let robot = RobotConfig::paper();
    let stories = stories(&Spec::paper(), &robot, true);
    assert_eq!(total(&stories, Story::gripped), 0);
    assert_eq!(total(&stories, Story::deposited), 0);
    for story in &stories {
        assert!(story.events.is_empty(), "it broke or dropped something: {:?}", story.events);
        // The fastest joint of the hardware turns at 5.26 rad/s; a servo may overshoot its ramp by a tenth.
        assert!(story.top_speed < 1.1 * 5.26, "{}", story.top_speed);
    }
}

#[test]
fn an_infinitely_strong_stem_is_never_detached() {
    let mut spec = Spec::paper();
    spec.fruit.detach_force = spec.fruit.detach_force.with_ends(1e9, 1e9).unwrap();
    let stories = stories(&spec, &RobotConfig::paper(), false);
    assert!(total(&stories, Story::gripped) > 0, "the fingers never closed on a fruit: nothing was tried");
    assert_eq!(total(&stories, Story::detached), 0);
}
