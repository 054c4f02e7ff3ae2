//! Faults between the robot and the expert: each is noticed, told in the record, and handled without damage; then the harvest goes on.

use orchard_scenario::Scenario;
use orchard_spec::Spec;
use orchard_tasks::harvest::episode::{AlarmTime, EpisodeRecord};
use orchard_tasks::harvest::{Harvest, trial};

/// A tuning seed, on whose tree the expert is known to pick.
const SEED: u64 = 20250704;
/// Length of an episode, and beginning and end of the fault in it \[s\].
const SECONDS: f64 = 40.0;
const FROM: f64 = 8.0;
const UNTIL: f64 = 22.0;

/// An episode under a condition of the benchmark in the field, with the fault at this test's times.
fn episode(condition: &str) -> EpisodeRecord {
    let scenario = Scenario::of(&[("controller", "expert")]).expect("built in").on_protocol("field");
    let harvest = Harvest::new(scenario).expect("the field's matrix");
    let faulty = harvest.scenario_of(condition).expect("a condition");
    let mut spec = Spec::clone(faulty.spec());
    let fault = &mut spec.sensing.as_mut().expect("with a fault").fault;
    fault.from = fault.from.with_value(FROM).expect("in range");
    fault.until = fault.until.with_value(UNTIL).expect("in range");
    trial(&faulty.with_spec(spec), SEED, 0, SECONDS).expect("the world is built")
}

/// Checks that one of some alarms begins within `late` seconds of the fault's beginning, that nothing broke meanwhile, and that the expert tried fruit
/// after the fault; returns the alarm.
fn told(condition: &str, alarms: &[&str], late: f64) -> AlarmTime {
    let record = episode(condition);
    let told = record.alarms.iter().find(|a| alarms.contains(&&*a.alarm));
    let told = told.unwrap_or_else(|| panic!("{condition}: alarms are {:?}", record.alarms)).clone();
    assert!((FROM..FROM + late).contains(&told.from), "{condition}: {told:?}");
    assert!(record.alarms.iter().all(|a| a.from >= FROM), "{condition}: {:?}", record.alarms);
    let broken = record.branches_snapped.iter().filter(|snap| (FROM..UNTIL + 1.0).contains(&snap.time));
    assert_eq!(broken.count(), 0, "{condition}: {:?}", record.branches_snapped);
    let later = record.attempts.iter().filter(|attempt| attempt.start_time > UNTIL);
    assert!(later.count() > 0, "{condition}: no attempt after the fault: {:?}", record.alarms);
    assert!(record.gave_up.is_none());
    told
}

/// Checks that a lasting alarm ends within `late` seconds of the fault's end.
fn told_and_over(condition: &str, alarms: &[&str], late: [f64; 2]) {
    let told = told(condition, alarms, late[0]);
    let until = told.until.unwrap_or_else(|| panic!("{condition}: {told:?} has no end"));
    assert!((FROM..UNTIL + late[1]).contains(&until), "{condition}: {told:?}");
}

#[test]
fn a_dead_camera_is_told() {
    told_and_over("fault-camera-dead", &["camera_silent"], [6.0, 1.0]);
}

/// A camera may freeze on an image that shows nothing, as with the hand in the bucket.
#[test]
fn a_frozen_camera_is_told() {
    told_and_over("fault-camera-frozen", &["camera_frozen", "camera_blind"], [6.0, 1.0]);
}

#[test]
fn a_late_camera_is_told() {
    told_and_over("fault-camera-late", &["camera_late"], [6.0, 2.0]);
}

#[test]
fn an_image_without_numbers_is_told() {
    told_and_over("fault-depth-not-finite", &["camera_blind"], [7.0, 1.0]);
}

#[test]
fn a_jump_of_the_odometry_is_told() {
    told("fault-odometry-jump", &["odometry_jump"], 0.1);
}

#[test]
fn fingers_that_do_not_close_are_told() {
    told_and_over("fault-fingers-stuck", &["hand_stuck"], [UNTIL - FROM, 6.0]);
}

#[test]
fn a_limb_on_the_arm_is_told() {
    told_and_over("fault-limb-on-arm", &["arm_loaded"], [6.0, 2.0]);
}

#[test]
fn a_lost_fruit_is_told() {
    told("fault-fruit-lost", &["fruit_lost"], UNTIL - FROM);
}

#[test]
fn a_reading_that_is_no_number_is_told() {
    told_and_over("fault-reading-not-finite", &["reading_not_finite"], [0.1, 0.1]);
}
