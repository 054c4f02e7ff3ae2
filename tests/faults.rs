//! Faults between the robot and the expert: each is noticed in time, told by its name, and handled without damage; then the harvest goes on.

use orchard_picker::{Alarm, Event, State};
use orchard_scenario::Scenario;
use orchard_spec::Spec;
use orchard_tasks::harvest::interface::BenchWorld;
use orchard_world::{World, WorldEvent};

/// A tuning seed, on whose trees the expert is known to pick.
const SEED: u64 = 20250704;
/// Beginning and end of a fault, and length of an episode \[s\].
const FROM: f64 = 6.0;
const UNTIL: f64 = 13.0;
const SECONDS: f64 = 20.0;
/// Largest contact force on the hand from the notice until the alarm is over \[N\]: as in a pull without a fault.
const FORCE: f64 = 50.0;
/// Longest fall of a fruit from a tree \[s\].
const FALL: f64 = 1.0;

/// Record of a short episode of the expert.
struct Run {
    /// Alarms that begin (true) and end, with their times \[s\].
    alarms: Vec<(f64, Alarm, bool)>,
    /// States that begin, with their times \[s\].
    states: Vec<(f64, State)>,
    /// Events of the world, with their times \[s\].
    events: Vec<(f64, WorldEvent)>,
    /// Time \[s\] and contact force on the hand \[N\] of each frame.
    forces: Vec<(f64, f64)>,
}

/// Runs the expert on a tree of [`SEED`] under a kind of fault, from [`FROM`] to `until` \[s\].
fn run(kind: &str, tree: u32, until: f64) -> Run {
    let scenario = Scenario::of(&[("controller", "expert")]).expect("built in");
    let text = format!(
        "[fault]\nbase = 'standard'\nkind = '{kind}'\n\
         from = {{ value = {FROM}, range = [0, 36000], unit = 's', source = 'test' }}\n\
         until = {{ value = {until}, range = [0, 36000], unit = 's', source = 'test' }}"
    );
    let spec: Spec = scenario.spec().overlaid("fault.toml", text.parse().expect("TOML")).expect("in range");
    let scenario = scenario.with_spec(spec);
    let frame = scenario.spec().sim.frame();
    let mut world = scenario.world(SEED, tree, 0).expect("it grows");
    let mut controller = scenario.controller();
    let (mut events, mut forces) = (Vec::new(), Vec::new());
    for k in 0..(SECONDS / frame).round() as u32 {
        let time = f64::from(k) * frame;
        let command = controller.act(&world.observe());
        World::step(&mut world, &command);
        events.extend(World::drain_events(&mut world).into_iter().map(|event| (time, event)));
        forces.push((time, world.hand_forces().wrist));
    }
    let told = |event: &Event| match *event {
        Event::Alarm { time, alarm } => Some((time, alarm, true)),
        Event::AlarmEnded { time, alarm } => Some((time, alarm, false)),
        _ => None,
    };
    let entered = |event: &Event| match *event {
        Event::StateChanged { time, state } => Some((time, state)),
        _ => None,
    };
    let record = &controller.record().events;
    Run {
        alarms: record.iter().filter_map(told).collect(),
        states: record.iter().filter_map(entered).collect(),
        events,
        forces,
    }
}

impl Run {
    /// Checks that one of some alarms, and no other one, is told within some seconds of the fault's beginning, and that from then until the alarm is over
    /// no branch snaps, no fruit drops and nothing presses hard on the hand. What the harvest does later is no matter of the fault.
    fn tells(&self, alarms: &[Alarm], within: f64) -> &Self {
        let all = &self.alarms;
        let told = all.first().unwrap_or_else(|| panic!("no alarm")).0;
        assert!(all.iter().all(|(_, alarm, _)| alarms.contains(alarm)), "{all:?}");
        // A reading that cannot be read is told with the time of the last one that could.
        assert!((FROM - 0.02..FROM + within).contains(&told), "{all:?}");
        let at_once = alarms.iter().all(|alarm| matches!(alarm, Alarm::OdometryJump | Alarm::FruitLost));
        // What is over at once is handled once the expert goes for its next fruit.
        let next = self.states.iter().find(|(time, state)| at_once && *time > told && *state == State::Align);
        let unended = next.map_or(f64::INFINITY, |(time, _)| *time);
        let over = all.iter().rev().find(|(.., begins)| !begins).map_or(unended, |ended| ended.0);
        let later: Vec<_> =
            self.events.iter().filter(|(time, _)| (told..over + FALL).contains(time)).collect();
        let damage = |event: &WorldEvent| {
            matches!(event, WorldEvent::BranchSnapped { .. } | WorldEvent::FruitDropped { .. })
        };
        assert!(!later.iter().any(|(_, event)| damage(event)), "{all:?} {later:?}");
        let then = self.forces.iter().filter(|(time, _)| (told..over).contains(time));
        let largest = then.map(|(_, force)| *force).fold(0.0, f64::max);
        assert!(largest < FORCE, "{largest} N, {all:?}");
        self
    }

    /// Checks that the last alarm ends within some seconds of the fault's end, and that the expert then goes for a fruit.
    fn and_is_over(&self, within: f64) {
        let Some(&(over, _, false)) = self.alarms.last() else { panic!("{:?}", self.alarms) };
        assert!((UNTIL..UNTIL + within).contains(&over), "{:?}", self.alarms);
        self.goes_on(over);
    }

    fn goes_on(&self, after: f64) {
        let goes = |(time, state): &(f64, State)| *time > after && *state == State::Align;
        assert!(self.states.iter().any(goes), "{:?}", self.states);
    }

    fn stands_safe(&self) -> &Self {
        assert!(self.states.iter().any(|(_, state)| *state == State::Safe), "{:?}", self.states);
        self
    }
}

#[test]
fn without_a_fault_nothing_is_told() {
    for tree in [0, 1] {
        let run = run("none", tree, UNTIL);
        assert_eq!(run.alarms, [], "tree {tree}");
        assert!(run.states.iter().all(|(_, state)| *state != State::Safe));
        assert!(run.events.iter().any(|(_, event)| matches!(event, WorldEvent::FruitDeposited { .. })));
    }
}

#[test]
fn a_dead_camera_is_told() {
    let run = run("camera_dead", 0, UNTIL);
    run.tells(&[Alarm::CameraSilent], 1.0).stands_safe().and_is_over(0.3);
}

/// A camera that stays dead leaves the robot in its safe state; the fruit in its hand has come to the bucket.
#[test]
fn a_camera_that_stays_dead_ends_the_harvest_safely() {
    let run = run("camera_dead", 0, 1000.0);
    run.tells(&[Alarm::CameraSilent], 1.0);
    assert_eq!(run.states.last().map(|(_, state)| *state), Some(State::Safe));
    assert!(run.events.iter().any(|(_, event)| matches!(event, WorldEvent::FruitDeposited { .. })));
}

#[test]
fn a_frozen_camera_is_told() {
    run("camera_frozen", 0, UNTIL).tells(&[Alarm::CameraFrozen], 1.0).stands_safe().and_is_over(0.3);
}

/// Before the first late image comes, none comes.
#[test]
fn a_late_camera_is_told() {
    let run = run("camera_late", 0, UNTIL);
    run.tells(&[Alarm::CameraSilent, Alarm::CameraLate], 1.0).stands_safe().and_is_over(0.3);
    let late = run.alarms.iter().find(|(_, alarm, _)| *alarm == Alarm::CameraLate);
    assert!(late.is_some_and(|(time, ..)| *time < FROM + 2.0), "{:?}", run.alarms);
}

/// With the hand at the bucket an image without anything in it is no fault.
#[test]
fn a_blank_camera_is_told() {
    // The fault begins while the hand brings a fruit to the bucket, where the camera sees nothing anyhow; it is told 1.5 s after the hand came out, at 9.7 s.
    run("camera_blank", 0, UNTIL).tells(&[Alarm::CameraBlind], 5.5).stands_safe().and_is_over(0.3);
}

#[test]
fn a_jump_of_the_odometry_is_told() {
    let run = run("odometry_jump", 1, UNTIL);
    run.tells(&[Alarm::OdometryJump], 0.02).goes_on(FROM);
    assert_eq!(run.alarms.len(), 1, "{:?}", run.alarms);
    assert!(run.events.iter().any(|(_, event)| matches!(event, WorldEvent::FruitDeposited { .. })));
}

#[test]
fn a_reading_that_is_no_number_is_told() {
    run("reading_not_finite", 0, UNTIL).tells(&[Alarm::ReadingNotFinite], 0.02).and_is_over(0.02);
}

/// Fingers are found stuck when they next close, and tested every few seconds after that.
#[test]
fn fingers_that_do_not_close_are_told() {
    run("fingers_stuck", 1, UNTIL).tells(&[Alarm::HandStuck], 2.0).stands_safe().and_is_over(5.0);
}

/// The fruit falls when its stem has broken; it is the only one.
#[test]
fn a_lost_fruit_is_told() {
    let run = run("fruit_lost", 1, UNTIL);
    run.tells(&[Alarm::FruitLost], 4.0).goes_on(FROM);
    let dropped = run.events.iter().filter(|(_, event)| matches!(event, WorldEvent::FruitDropped { .. }));
    assert_eq!(dropped.count(), 1, "{:?}", run.events);
}

/// The arm gives way under the weight; a fruit in the hand stays there.
#[test]
fn a_weight_on_the_arm_is_told() {
    run("weight_on_arm", 0, UNTIL).tells(&[Alarm::ArmLoaded], 1.0).and_is_over(1.0);
}
