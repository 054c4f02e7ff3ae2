use super::*;
use orchard_spec::Spec;

const REST: RestRule = RestRule { speed: 0.01, frames: 3 };
const WAKE: WakeRule = WakeRule { speed: 0.01, touching_gap: 0.001, frame_time: 0.1, fall: 0.05 };

fn spec() -> FruitSpec {
    Spec::paper().fruit
}

fn off_stem(phase: Phase) -> Life {
    Life { phase, ..Life::hanging() }
}

fn asleep() -> Phase {
    Phase::Asleep(Resting::Ground(Vec3::zeros()))
}

/// Judges a fruit at rest at a height; returns the events.
fn judge(life: &mut Life, touch: Touch, z_world: f64, v_world: Vec3) -> Vec<LooseEvent> {
    let mut events = Vec::new();
    life.judge(4, &touch, REST, &Vec3::new(0.0, 0.0, z_world), &v_world, &Vec3::zeros(), &mut events);
    events
}

#[test]
fn a_stem_gives_way_to_a_pull_that_lasts() {
    let spec = spec();
    let mut life = Life::hanging();
    let load = |life: &mut Life, pull| life.load_stem(&spec, pull, 0.0, 20.0, &Vec3::zeros());
    for _ in 1..spec.pull_frames.get() {
        assert!(!load(&mut life, 20.1));
    }
    // A frame without the load starts the count anew; the threshold itself is no load.
    assert!(!load(&mut life, 20.0));
    for _ in 1..spec.pull_frames.get() {
        assert!(!load(&mut life, 20.1));
    }
    assert_eq!(life.phase, Phase::Hanging);
    assert!(load(&mut life, 20.1));
    assert_eq!(life.phase, Phase::InHand);
}

#[test]
fn a_stem_gives_way_to_a_tension_that_lasts() {
    let spec = spec();
    let mut life = Life::hanging();
    let tension = 20.0 * spec.tension_factor.si();
    assert!(!life.load_stem(&spec, 0.0, tension, 20.0, &Vec3::zeros()));
    for _ in 1..spec.tension_frames.get() {
        assert!(!life.load_stem(&spec, 0.0, 1.01 * tension, 20.0, &Vec3::zeros()));
    }
    assert!(life.load_stem(&spec, 0.0, 1.01 * tension, 20.0, &Vec3::zeros()));
    assert_eq!(life.phase, Phase::InHand);
}

#[test]
fn the_engine_takes_a_fruit_that_the_hand_has_left() {
    let spec = spec();
    let mut life = off_stem(Phase::InHand);
    let (away, near) = (Touch::default(), Touch { graspable: true, ..Touch::default() });
    for touch in [near, Touch { hand: true, ..Touch::default() }] {
        for _ in 1..spec.hand_over_frames.get() {
            assert_eq!(life.end_frame_off_stem(&spec, &away), None);
        }
        assert_eq!(life.end_frame_off_stem(&spec, &touch), None);
    }
    for _ in 1..spec.hand_over_frames.get() {
        assert_eq!(life.end_frame_off_stem(&spec, &away), None);
    }
    assert_eq!(life.end_frame_off_stem(&spec, &away), Some(HandOver::ToEngine));
    assert_eq!(life.phase, Phase::Free);
}

#[test]
fn the_hand_takes_a_graspable_fruit_back() {
    let spec = spec();
    for phase in [Phase::Free, asleep()] {
        let mut life = off_stem(phase);
        // A touch alone does not suffice.
        let touch = Touch { hand: true, finger: true, ..Touch::default() };
        assert_eq!(life.end_frame_off_stem(&spec, &touch), None);
        assert_eq!(life.phase, phase);
        let touch = Touch { graspable: true, ..Touch::default() };
        assert_eq!(life.end_frame_off_stem(&spec, &touch), Some(HandOver::ToHand));
        assert_eq!(life.phase, Phase::InHand);
    }
    let touch = Touch { graspable: true, ..Touch::default() };
    assert_eq!(Life::hanging().end_frame_off_stem(&spec, &touch), None);
}

#[test]
fn a_still_island_sleeps_on_its_support() {
    let ground = Island {
        is_still: true,
        touches_arm: false,
        is_on_base: false,
        is_on_ground: true,
        base_drives: false,
    };
    let base = Island { is_on_base: true, is_on_ground: false, ..ground };
    assert_eq!(ground.support(), Some(Support::Ground));
    assert_eq!(base.support(), Some(Support::Base));
    assert_eq!(Island { is_on_ground: true, ..base }.support(), Some(Support::Ground));
    assert_eq!(Island { base_drives: true, ..ground }.support(), Some(Support::Ground));
    for awake in [
        Island { is_still: false, ..ground },
        Island { touches_arm: true, ..ground },
        Island { base_drives: true, ..base },
    ] {
        assert_eq!(awake.support(), None, "{awake:?}");
    }
}

#[test]
fn a_sleeping_fruit_wakes_and_must_be_quiet_anew() {
    let mut life = off_stem(Phase::Free);
    for _ in 0..REST.frames {
        judge(&mut life, Touch::default(), 0.0, Vec3::zeros());
    }
    assert!(life.is_quiet(REST));
    life.wake();
    assert!(life.is_quiet(REST), "an awake fruit stays as it is");
    life.sleep(Resting::Ground(Vec3::zeros()));
    assert_eq!(life.phase, asleep());
    life.wake();
    assert_eq!(life.phase, Phase::Free);
    assert!(!life.is_quiet(REST));
}

#[test]
fn fast_bodies_wake_within_their_reach() {
    assert!(!WAKE.is_shaken(0.01) && WAKE.is_shaken(0.011));
    assert_eq!(WAKE.reach(0.03, 0.01), None);
    let reach = WAKE.reach(0.03, 1.0).unwrap();
    assert!((reach - (0.03 + 0.001 + 0.1 + 0.05)).abs() < 1e-15, "{reach}");
    assert!(WAKE.touches(0.03, 0.02, 0.0509) && !WAKE.touches(0.03, 0.02, 0.0511));
}

#[test]
fn a_fruit_is_dropped_once_with_the_speed_before() {
    let mut life = off_stem(Phase::Free);
    assert_eq!(judge(&mut life, Touch::default(), 0.1, Vec3::new(0.0, 0.0, -2.0)), []);
    assert_eq!(life.state(false, false), FruitState::Loose);
    let ground = Touch { ground: true, ..Touch::default() };
    let events = judge(&mut life, ground, 0.03, Vec3::new(0.0, 0.0, 0.6));
    assert_eq!(events, [LooseEvent::Dropped { fruit: 4, speed: 2.0 }]);
    assert_eq!(judge(&mut life, ground, 0.03, Vec3::zeros()), []);
    assert_eq!(life.state(false, false), FruitState::Dropped);
}

#[test]
fn a_fruit_is_deposited_when_it_rests_in_the_bucket() {
    let mut life = off_stem(Phase::InHand);
    life.dropped = true;
    let finger = Touch { finger: true, in_bucket: true, ..Touch::default() };
    judge(&mut life, finger, 0.8, Vec3::zeros());
    life.strike(Partner::Hand, 0.5, 0.75);
    life.strike(Partner::Bucket, 0.2, 0.6);
    life.strike(Partner::Bucket, 0.1, 0.5);
    let bucket = Touch { in_bucket: true, on_base: true, ..Touch::default() };
    for _ in 1..REST.frames {
        assert_eq!(judge(&mut life, bucket, 0.5, Vec3::zeros()), []);
    }
    let events = judge(&mut life, bucket, 0.5, Vec3::zeros());
    let [LooseEvent::Deposited { fruit: 4, drop_height, impact_energy }] = events[..] else {
        panic!("{events:?}")
    };
    // The hand's impact ends no fall.
    assert!((drop_height - 0.2).abs() < 1e-15 && impact_energy == 0.2);
    assert_eq!(life.state(false, false), FruitState::Deposited);
    assert!(!life.dropped);
    assert_eq!(life.take_struck(), Some((Partner::Hand, 0.5)));
    assert_eq!(life.take_struck(), None);

    judge(&mut life, Touch::default(), 0.5, Vec3::new(1.0, 0.0, 0.0));
    assert_eq!(life.state(false, false), FruitState::Loose);
}

#[test]
fn a_grip_lasts_until_both_fingers_let_go() {
    assert!(!is_gripped(false, [true, false]));
    assert!(is_gripped(false, [true, true]));
    assert!(is_gripped(true, [false, true]));
    assert!(!is_gripped(true, [false, false]));
}

#[test]
fn the_state_is_the_first_that_holds() {
    let hanging = Life::hanging();
    assert_eq!(hanging.state(false, true), FruitState::OnTree);
    assert_eq!(hanging.state(true, true), FruitState::OnBrokenLimb);
    let mut life = off_stem(Phase::InHand);
    assert_eq!(life.state(true, false), FruitState::Loose);
    (life.deposited, life.dropped) = (true, true);
    assert_eq!(life.state(true, true), FruitState::Held);
    assert_eq!(life.state(true, false), FruitState::Deposited);
    life.deposited = false;
    assert_eq!(life.state(true, false), FruitState::Dropped);
}

/// A fruit that left the field stays deposited, is calm, and nothing wakes, drops or grasps it.
#[test]
fn a_fruit_taken_away_stays_away() {
    let mut life = Life { deposited: true, ..off_stem(Phase::Asleep(Resting::Base(Vec3::zeros()))) };
    assert!(!life.is_calm());
    life.take_away(Vec3::x());
    let away = life.clone();
    let touch = Touch { ground: true, finger: true, hand: true, graspable: true, ..Touch::default() };
    assert_eq!(judge(&mut life, touch, 0.0, Vec3::x()), []);
    assert_eq!(life.end_frame_off_stem(&spec(), &touch), None);
    life.wake();
    assert!(life == away && life.is_calm() && life.is_away());
    assert_eq!(life.state(false, false), FruitState::Deposited);
}
