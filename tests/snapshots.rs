//! Snapshot, restore and continue gives the same bits as never having stopped.

use orchard_geometry::Vec3;
use orchard_robot::{Command, PAPER_URDF, RobotConfig, RobotModel};
use orchard_spec::Spec;
use orchard_tests::{fingerprint, watched_pick};
use orchard_world::truth::FruitState;
use orchard_world::{Difference, Snapshot, SnapshotError, Status, World, WorldEvent};
use proptest::prelude::*;
use std::sync::{Arc, LazyLock};

/// Frames that a restored world is followed for.
const FOLLOWED: usize = 90;

fn world(seed: u64, index: u32) -> World {
    World::new(Arc::new(Spec::paper()), Arc::new(RobotModel::paper()), seed, index).unwrap()
}

fn print(world: &mut World) -> [u8; 32] {
    let observation = world.observe();
    fingerprint(world, &observation)
}

/// Everything about a run, by frame; entry 0 is the start.
#[derive(Default)]
struct Record {
    snapshots: Vec<Snapshot>,
    prints: Vec<[u8; 32]>,
}

impl Record {
    fn add(&mut self, world: &mut World) {
        self.prints.push(print(world));
        self.snapshots.push(world.snapshot());
    }

    /// Goes back to a frame in memory in a used world, and through bytes in a new one; `act` then drives both as
    /// it drove the recorded run.
    fn resume(&self, what: &str, frame: usize, used: &mut World, seed: u64, act: impl Fn(&mut World, usize)) {
        let mut fresh = world(seed, 0);
        let bytes = self.snapshots[frame].to_bytes();
        fresh.restore(&Snapshot::from_bytes(&bytes).unwrap()).unwrap();
        assert!(fresh.snapshot().to_bytes() == bytes, "{what}: the bytes of the restored world differ");
        used.restore(&self.snapshots[frame]).unwrap();
        let last = (frame + FOLLOWED).min(self.prints.len() - 1);
        for (name, world) in [("in memory", used), ("through bytes", &mut fresh)] {
            assert_eq!(print(world), self.prints[frame], "{what}, frame {frame}, {name}: not restored");
            for next in frame + 1..=last {
                act(world, next);
                let same = print(world) == self.prints[next];
                assert!(same, "{what}, {name}: restored at frame {frame}, differs at frame {next}");
            }
        }
    }
}

/// A pick by script: on the way between two images, as the fingers close, with the stem under load, and with the
/// fruit in the hand, events not yet taken.
#[test]
fn a_pick_goes_on_with_the_same_bits() {
    const SEED: u64 = 1;
    let mut start = world(SEED, 0);
    let mut record = Record::default();
    record.add(&mut start);
    let (mut commands, mut moments): (Vec<Command>, Vec<(&str, usize)>) = (Vec::new(), Vec::new());
    let pick = watched_pick(&Spec::paper(), &RobotModel::paper(), SEED, &mut |world, command| {
        commands.push(*command);
        record.add(world);
        let states: Vec<FruitState> = world.fruit_truth().iter().map(|f| f.state).collect();
        let is_held = |i| world.is_held(i);
        let presses = world.report().contacts.iter().any(|c| c.force_world != Vec3::zeros());
        let held_on_tree = (0..states.len()).any(|i| is_held(i) && states[i] == FruitState::OnTree);
        let pulled = world.fruit_lives().peak_tension() > 10.0;
        let frame = record.prints.len() - 1;
        for (what, now) in [
            ("on the way", frame == 101),
            ("first touch", presses),
            ("gripped on its stem", held_on_tree),
            ("stem under load", held_on_tree && pulled),
            ("in the hand", states.contains(&FruitState::Held)),
        ] {
            if now && moments.iter().all(|m| m.0 != what) {
                moments.push((what, frame));
            }
        }
    });
    assert!(pick.is_some_and(|pick| pick.gripped && pick.detached && pick.held), "{pick:?}");
    assert_eq!(moments.len(), 5, "the run lacks a moment: {moments:?}");
    for (what, frame) in moments {
        let mut used = start.clone();
        used.break_branch(3);
        record.resume(what, frame, &mut used, SEED, |world, next| world.step(&commands[next - 1]));
    }
}

/// The robot rams a tree whose limbs break and whose fruit comes off: with contacts, while joints count towards
/// their rupture, amid the friction ramp of a fresh break, with fruit in the air and rolling, and quarantined.
#[test]
fn a_disaster_goes_on_with_the_same_bits() {
    const SEED: u64 = 17;
    let mut run = world(SEED, 0);
    let segments = run.skeleton().segments.clone();
    let limb = segments.iter().position(|s| s.order == 1).unwrap();
    let lateral = segments.iter().rposition(|s| s.order == 2).unwrap();
    let ram = Command { base_velocity: [1.1, 0.1, 0.1], ..RobotModel::paper().start_command() };
    let act = |world: &mut World, frame: usize| {
        let lateral = world.tree().bodies[lateral].index();
        match frame {
            20 => world.break_branch(limb),
            30 => world.data_mut().body_force_world[lateral].z = -400.0,
            60 => world.data_mut().body_force_world[lateral].z = 0.0,
            70..=90 => (0..6).for_each(|i| {
                let point = world.fruit().points[i].index();
                let pull =
                    if world.data().tethered[point] { Vec3::new(80.0, 10.0, 0.0) } else { Vec3::zeros() };
                world.data_mut().point_force_world[point] = pull;
            }),
            400 => world.data_mut().v[5] = f64::NAN,
            _ => {}
        }
        world.step(&ram);
    };
    let mut record = Record::default();
    let mut moments = vec![("fresh break", 21)];
    record.add(&mut run);
    for frame in 1..=410 {
        let known = run.rupture().breaks().len();
        act(&mut run, frame);
        record.add(&mut run);
        let snapped = run.rupture().breaks().len() > known && frame != 20;
        let wood = run.report().contacts.iter().filter(|c| c.force_world != Vec3::zeros()).count() >= 2;
        let states: Vec<FruitState> = run.fruit_truth().iter().map(|f| f.state).collect();
        for (what, at, now) in [
            ("one frame before a joint breaks", frame - 1, snapped),
            ("several contacts", frame, wood),
            ("fruit in the air", frame, states.contains(&FruitState::Loose)),
            ("fruit on the ground", frame, states.contains(&FruitState::Dropped)),
            ("quarantined", frame, *run.status() != Status::Running),
        ] {
            if now && moments.iter().all(|m| m.0 != what) {
                moments.push((what, at));
            }
        }
    }
    assert_eq!(moments.len(), 6, "the run lacks a moment: {moments:?}");
    let events = run.drain_events();
    assert!(events.iter().any(|e| matches!(e, WorldEvent::BranchSnapped { .. })));
    assert!(events.iter().any(|e| matches!(e, WorldEvent::FruitDetached { .. })));
    for (what, frame) in moments {
        record.resume(what, frame, &mut run, SEED, act);
    }
}

/// Numbers keep their bits on the way through bytes: negative zero, subnormal, the payload of a NaN.
#[test]
fn odd_numbers_keep_their_bits() {
    let mut odd = world(3, 0);
    let bits = [-0.0_f64, f64::from_bits(1), f64::from_bits(0x7ff8_dead_beef_0001), f64::MAX];
    odd.data_mut().v[..4].copy_from_slice(&bits);
    let mut other = world(3, 0);
    other.restore(&Snapshot::from_bytes(&odd.snapshot().to_bytes()).unwrap()).unwrap();
    for (found, expected) in other.data().v.iter().zip(&bits) {
        assert_eq!(found.to_bits(), expected.to_bits());
    }
}

/// A world takes its own snapshots only, says what differs, and stays as it is when it refuses.
#[test]
fn other_worlds_are_refused() {
    let snapshot = world(3, 1).snapshot();
    let mut spec = Spec::paper();
    spec.wood.density = spec.wood.density.with_value(900.0).unwrap();
    let mut config = RobotConfig::paper();
    let base = config.drive.as_mut().unwrap();
    base.speed_max = base.speed_max.with_value(1.0).unwrap();
    let slow = RobotModel::from_urdf(PAPER_URDF, &config).unwrap();
    let renamed = PAPER_URDF.replacen("<robot name=\"", "<robot name=\"my_", 1);
    let renamed = RobotModel::from_urdf(&renamed, &RobotConfig::paper()).unwrap();
    let build = |spec: &Spec, robot: &RobotModel, seed, index| {
        World::new(Arc::new(spec.clone()), Arc::new(robot.clone()), seed, index).unwrap()
    };
    let (paper, robot) = (Spec::paper(), RobotModel::paper());
    for (mut other, difference) in [
        (build(&spec, &robot, 3, 1), Difference::Spec),
        (build(&paper, &slow, 3, 1), Difference::Robot),
        (build(&paper, &renamed, 3, 1), Difference::Robot),
        (build(&paper, &robot, 4, 1), Difference::Seed { saved: 3, here: 4 }),
        (build(&paper, &robot, 3, 0), Difference::World { saved: 1, here: 0 }),
    ] {
        let before = other.snapshot().to_bytes();
        assert_eq!(other.restore(&snapshot), Err(SnapshotError::OtherWorld(difference)));
        assert!(other.snapshot().to_bytes() == before);
    }
    assert_eq!(build(&paper, &robot, 3, 1).restore(&snapshot), Ok(()));
}

static BYTES: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let mut world = world(3, 0);
    world.step(&RobotModel::paper().start_command());
    world.observe();
    world.snapshot().to_bytes()
});

proptest! {
    /// Whatever happens to the bytes of a file, reading it is an error, not a panic and not another world.
    #[test]
    fn damaged_bytes_are_an_error(
        at in any::<prop::sample::Index>(),
        bit in 0..8_u32,
        cut in any::<prop::sample::Index>(),
        more in prop::collection::vec(any::<u8>(), 1..40),
    ) {
        let refused = |bytes: &[u8]| Snapshot::from_bytes(bytes).is_err();
        let mut flipped = BYTES.clone();
        flipped[at.index(BYTES.len())] ^= 1 << bit;
        prop_assert!(refused(&flipped));
        let short = cut.index(BYTES.len());
        prop_assert!(refused(&BYTES[..short]));
        prop_assert!(refused(&BYTES[short + 1..]));
        prop_assert!(refused(&[&BYTES[..], &more].concat()));
        let replaced = [&BYTES[..short], &more, &BYTES[(short + more.len()).min(BYTES.len())..]].concat();
        prop_assert!(replaced == *BYTES || refused(&replaced));
        prop_assert!(refused(&more));
    }
}
