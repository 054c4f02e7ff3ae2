//! Hashes of harvest episodes on preset `paper`, the same on every processor and for good.
//!
//! `episode_hashes.txt` holds a hash for each episode: every command of the controller, every event of the world, and the state at the
//! end. `baseline` on preset `paper` keeps these motions whatever later work adds, so its lines never change; those of `expert`
//! change only with a new version of `expert`. After such a change, write the file anew,
//!
//! `cargo test -p orchard-tests --test suite episodes::write -- --ignored`
//!
//! and say so in `CHANGELOG.md` under "Results".

use orchard_perception::DetectorConfig;
use orchard_picker::{Controller, Kind};
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_tests::state_hash;
use orchard_world::{Status, World, WorldEvent};
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use std::sync::Arc;

const COMMITTED: &str = include_str!("episode_hashes.txt");
const SECONDS: f64 = 40.0;

/// Seeds and trees: one of a tuning seed, two of the first official seed `v1`.
const WORLDS: [(u64, u32); 3] = [(20250704, 0), (59313826611509, 0), (59313826611509, 1)];

fn bits(hash: &mut Sha256, numbers: &[f64]) {
    for number in numbers {
        hash.update(number.to_bits().to_le_bytes());
    }
}

fn take_command(hash: &mut Sha256, command: &Command) {
    bits(hash, &command.arm_q);
    bits(hash, &command.arm_v);
    bits(hash, &command.base_velocity);
    bits(hash, &[command.finger_q, command.finger_force]);
}

/// True of the kinds of events that the hashes cover. Finger contacts came later; commands, states and grips cover them. The paper's robot has
/// no cup.
fn is_hashed(event: &WorldEvent) -> bool {
    !matches!(
        event,
        WorldEvent::FingerContactBegan { .. }
            | WorldEvent::FingerContactEnded { .. }
            | WorldEvent::SealLost { .. }
    )
}

/// An event that [`is_hashed`], with its numbers in a fixed order.
fn take_event(hash: &mut Sha256, event: &WorldEvent) {
    let mut take = |kind: &str, id: usize, numbers: &[f64]| {
        hash.update(kind.as_bytes());
        hash.update((id as u64).to_le_bytes());
        bits(hash, numbers);
    };
    match *event {
        WorldEvent::FruitGripped { fruit, .. } => take("gripped", fruit, &[]),
        WorldEvent::FruitDetached { fruit, tension, .. } => take("detached", fruit, &[tension]),
        WorldEvent::FruitDeposited { fruit, drop_height, impact_energy, .. } => {
            take("deposited", fruit, &[drop_height, impact_energy]);
        }
        WorldEvent::FruitImpact { fruit, energy, .. } => take("impact", fruit, &[energy]),
        WorldEvent::FruitDropped { fruit, speed, .. } => take("dropped", fruit, &[speed]),
        WorldEvent::BranchSnapped { segment, .. } => take("snapped", segment, &[]),
        WorldEvent::FingerContactBegan { .. }
        | WorldEvent::FingerContactEnded { .. }
        | WorldEvent::SealLost { .. }
        | WorldEvent::FruitTakenAway { .. } => {}
    }
}

fn episode(kind: Kind, seed: u64, tree: u32) -> String {
    let (spec, robot) = (Arc::new(Spec::paper()), Arc::new(RobotModel::paper()));
    let frames = (SECONDS * spec.sim.frame_rate.si()).round() as u32;
    let mut controller = kind.controller(&robot, DetectorConfig::paper());
    let mut world = World::new(spec, robot, seed, tree).unwrap();
    let (mut hash, mut events) = (Sha256::new(), 0);
    for frame in 0..frames {
        let command = controller.act(&world.observe());
        take_command(&mut hash, &command);
        world.step(&command);
        for event in world.drain_events().into_iter().filter(is_hashed) {
            events += 1;
            hash.update(frame.to_le_bytes());
            take_event(&mut hash, &event);
        }
    }
    assert_eq!(*world.status(), Status::Running);
    assert!(events > 0, "nothing happened");
    hash.update(state_hash(&world));
    let hex: String = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{} {seed} {tree} {hex}\n", kind.name())
}

fn computed() -> String {
    let kinds = [Kind::Baseline, Kind::Expert];
    let episodes: Vec<(Kind, (u64, u32))> =
        kinds.into_iter().flat_map(|kind| WORLDS.map(|world| (kind, world))).collect();
    let lines: Vec<String> =
        episodes.par_iter().map(|&(kind, (seed, tree))| episode(kind, seed, tree)).collect();
    lines.concat()
}

#[test]
fn episodes_have_the_committed_hashes() {
    let computed = computed();
    let differ: Vec<&str> = computed.lines().filter(|line| !COMMITTED.lines().any(|l| l == *line)).collect();
    assert!(
        differ.is_empty() && computed.lines().count() == COMMITTED.lines().count(),
        "These episodes move otherwise than those committed in tests/episode_hashes.txt:\n  {}\n\
         Motions of `baseline` on preset `paper` stay for good. See the head of this file.",
        differ.join("\n  ")
    );
}

#[test]
#[ignore = "overwrites the committed hashes"]
fn write() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/episode_hashes.txt");
    std::fs::write(path, computed()).unwrap();
}
