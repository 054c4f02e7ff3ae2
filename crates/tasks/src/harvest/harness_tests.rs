//! One fake episode, frame by frame.

use std::sync::atomic::AtomicBool;

use orchard_geometry::Vec3;
use orchard_robot::io::{Command, Observation};

use crate::fake::{FRAME, FakeController, FakeWorld, key};
use crate::harvest::episode::{
    AttemptOutcome, ContactOutcome, EpisodeKey, EpisodeRecord, FruitState, Outcome,
};
use crate::harvest::harness::run_episode;
use crate::harvest::interface::{BenchController, ControllerEvent, FruitTruth};
use crate::protocol::Protocol;

fn world() -> FakeWorld {
    let mut world = FakeWorld::new(1, 0);
    world.fruit = (0..4)
        .map(|i| FruitTruth {
            p_world: Vec3::new(f64::from(i), 0.0, 1.0),
            radius: 0.03,
            state: FruitState::OnTree,
        })
        .collect();
    world
}

fn run(mut world: FakeWorld, horizon_frames: u32) -> (EpisodeRecord, u32) {
    let mut controller = FakeController::new(&world);
    let mut frames = 0;
    let mut key = key();
    key.horizon_frames = horizon_frames;
    let record = run_episode(
        key,
        &mut world,
        &mut controller,
        &Protocol::paper(),
        FRAME,
        &AtomicBool::new(false),
        &mut || frames += 1,
    );
    (record.unwrap(), frames)
}

#[test]
fn an_episode_until_all_reachable_fruit_is_picked() {
    let (record, frames) = run(world(), 1000);
    // Fruit 2 is the last reachable one; it is dropped in the step after frame 26.
    assert_eq!(record.outcome, Outcome::AllReachablePicked);
    assert_eq!((record.frames, frames, record.duration_s), (27, 27, 13.5));
    assert_eq!((record.fruit_total, record.reachable_count), (4, 3));
    assert_eq!(record.reachable, [0, 1, 2]);
    assert_eq!(record.zone_census.values().sum::<u32>(), 3);
    let states: Vec<FruitState> = record.fruit.iter().map(|f| f.final_state).collect();
    assert_eq!(
        states,
        [FruitState::Deposited, FruitState::Deposited, FruitState::Dropped, FruitState::OnTree]
    );
    assert_eq!((record.fruit_dropped[0].fruit, record.fruit_dropped[0].frame), (2, 27));
    assert_eq!(record.branches_snapped[0].segment, 42);
    assert_eq!(record.max_stem_pull_n, Some(9.0));
    // Images at frames 0, 5, .. 25: fruit 0 is found in each, one detection is false, fruit 1 is too small to count.
    let tally = record.detection;
    assert_eq!((tally.images, tally.true_positives, tally.false_positives), (6, 6, 6));
    assert_eq!((tally.visible, tally.recalled), (6, 6));
}

#[test]
fn attempts_are_judged_by_truth() {
    let (record, _) = run(world(), 1000);
    assert_eq!(record.attempts.len(), 3);
    let first = &record.attempts[0];
    assert_eq!((first.start_frame, first.end_frame), (1, 8));
    assert_eq!((first.fruit, first.outcome), (Some(0), AttemptOutcome::Placed));
    // Gripped in the step after frame 2, that is at frame 3; at rest in the bucket at frame 7; ended at frame 8.
    assert_eq!((first.gripped.as_slice(), first.detached.as_slice()), ([0].as_slice(), [0].as_slice()));
    assert_eq!(first.cycle_time, Some(3.5));
    assert_eq!(first.max_stem_pull_n, Some(8.0));
    let states: Vec<(&str, f64)> = first.states.iter().map(|s| (s.state.as_str(), s.time)).collect();
    assert_eq!(states, [("reach", 0.5), ("deposit", 2.5)]);
    // The controller's own report is kept beside the truth: the target is the very centre of fruit 0.
    assert_eq!(first.belief.nearest_fruit, Some(0));
    assert!(first.belief.nearest_distance_m.is_some_and(|d| d < 1e-12));
    assert_eq!((first.belief.radius_m, first.belief.end.as_deref()), (0.03, Some("deposited")));
    assert_eq!((first.belief.grasp_width_m, first.belief.pull_n), (Some(0.06), Some(12.0)));
    assert_eq!((first.max_finger_force_n, first.max_wrist_force_n), (Some(8.0), Some(4.0)));
    assert_eq!(
        (record.fruit_deposited[0].drop_height_m, record.fruit_deposited[0].bruised),
        (Some(0.05), Some(true))
    );
    assert!(first.knocked_off.is_empty() && first.snapped.is_empty() && record.fruit_knocked_off.is_empty());
    // By contact: fingers on a fruit from frame 3 to frame 5 of ten, whatever the controller says.
    let by_contact: Vec<_> = record
        .contact_attempts
        .iter()
        .map(|a| (a.fruit, a.start_frame, a.end_frame, a.gripped, a.outcome))
        .collect();
    let expected = [
        (0, 3, 5, true, ContactOutcome::Placed),
        (1, 13, 15, true, ContactOutcome::Placed),
        (2, 23, 25, true, ContactOutcome::Dropped),
    ];
    assert_eq!(by_contact, expected);
    assert_eq!(record.contact_attempts[1].start_time, 6.5);
    // The last one was cut off by the end of the episode, with its fruit on the ground: it had been lost before.
    let last = &record.attempts[2];
    assert_eq!((last.outcome, last.failure_reason.as_deref()), (AttemptOutcome::Failed, Some("slipped")));
    assert_eq!(last.detached, [2]);
    assert_eq!((last.snapped[0].segment, last.snapped[0].state.as_deref()), (42, Some("deposit")));
    assert_eq!(last.zone, record.fruit[2].zone);
}

/// A controller that commits to no target declares no attempt; the world counts them all the same.
#[test]
fn a_controller_that_declares_no_attempt_is_scored_by_contact() {
    struct Silent(FakeController);
    impl BenchController for Silent {
        fn act(&mut self, observation: &Observation) -> Command {
            self.0.act(observation)
        }
        fn drain_log(&mut self) -> Vec<ControllerEvent> {
            self.0.drain_log();
            Vec::new()
        }
    }
    let (declared, _) = run(world(), 1000);
    let mut world = world();
    let mut silent = Silent(FakeController::new(&world));
    let key = EpisodeKey { horizon_frames: 1000, ..key() };
    let never = AtomicBool::new(false);
    let record =
        run_episode(key, &mut world, &mut silent, &Protocol::paper(), FRAME, &never, &mut || ()).unwrap();
    assert!(record.attempts.is_empty());
    assert_eq!(record.contact_attempts, declared.contact_attempts);
    assert_eq!((record.placed_by_contact().count(), record.contact_attempts.len()), (2, 3));
    // Three fruit came off their stems between its fingers: it knocked none off.
    assert_eq!((record.fruit_detached.len(), record.fruit_knocked_off.as_slice()), (3, [].as_slice()));
}

#[test]
fn budget_stall_and_quarantine_end_an_episode() {
    let (record, _) = run(world(), 12);
    assert_eq!((record.outcome, record.frames), (Outcome::BudgetSpent, 12));

    let mut still = world();
    still.moving = false;
    still.fruit.clear();
    let mut with_target = still;
    with_target.fruit.push(FruitTruth {
        p_world: Vec3::zeros(),
        radius: 0.03,
        state: FruitState::OnBrokenLimb,
    });
    with_target.frame = 1000;
    let (record, _) = run(with_target, 1000);
    // 15 s are 30 frames of 0.5 s.
    assert_eq!((record.outcome, record.frames), (Outcome::Stalled, 30));

    let mut broken = world();
    broken.breaks_at = Some(5);
    let (record, _) = run(broken, 1000);
    assert_eq!(record.frames, 5);
    assert_eq!(record.outcome, Outcome::Quarantined { reason: "not finite at frame 5".into() });
}

#[test]
fn no_fruit_and_broken_fruit_are_no_trouble() {
    let mut odd = world();
    odd.fruit[1].p_world.x = f64::NAN;
    odd.breaks_at = Some(0);
    let (record, _) = run(odd, 10);
    assert_eq!((record.frames, record.fruit_total, &record.zone_frame), (0, 0, &None));
    let text = serde_json::to_string(&record).unwrap();
    assert_eq!(serde_json::from_str::<EpisodeRecord>(&text).unwrap(), record);
}
