//! A world is independent of its neighbours: it has the same bits alone, among any others, on any number of threads, and
//! beside a quarantined world.

use orchard_env::{Backend, Env};
use orchard_robot::{Command, RobotModel};
use orchard_scenario::Scenario;
use orchard_spec::{Preset, Spec};
use orchard_tests::fingerprint;
use orchard_world::{Status, World, WorldEvent};
use std::ops::Range;
use std::sync::Arc;

const SEED: u64 = 5;
const FRAMES: u32 = 60;
/// World that gets a joint angle that is not a number, and the frame.
const FAULTY: u32 = 4;
const FAULT_AT: u32 = 20;

/// Command of a world's robot; each world has another one.
fn command(index: u32, frame: u32) -> Command {
    let mut command = RobotModel::paper().start_command();
    let turn = f64::from(index) - 3.5;
    command.base_velocity = [0.7, 0.05 * turn, 0.2 * turn];
    command.arm_q[3] += 0.01 * f64::from(frame);
    command
}

fn world(preset: Preset, index: u32) -> World {
    World::new(Arc::new(Spec::preset(preset)), Arc::new(RobotModel::paper()), SEED, index).unwrap()
}

/// A copy of a world with a joint angle that is not a number.
fn with_fault(preset: Preset, of: &World) -> World {
    let mut source = world(preset, FAULTY);
    source.restore(&of.snapshot()).unwrap();
    let q = source.model().qs(source.tree().bodies[5]).start;
    source.data_mut().q[q] = f64::NAN;
    let mut faulty = world(preset, FAULTY);
    faulty.restore(&source.snapshot()).unwrap();
    faulty
}

/// Fingerprint of a world's state and observation, and its events, frame by frame.
type Record = Vec<([u8; 32], Vec<WorldEvent>)>;

fn alone(preset: Preset, index: u32) -> Record {
    let mut world = world(preset, index);
    let mut record = Record::new();
    for frame in 0..FRAMES {
        if (index, frame) == (FAULTY, FAULT_AT) {
            world = with_fault(preset, &world);
        }
        let observation = world.observe();
        let print = fingerprint(&world, &observation);
        world.step(&command(index, frame));
        record.push((print, world.drain_events()));
    }
    assert_eq!(*world.status() == Status::Running, index != FAULTY);
    record
}

fn together(preset: Preset, indices: Range<u32>, threads: usize) -> Vec<Record> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let scenario = Scenario::of(&[("preset", preset.name())]).unwrap();
        let mut env = Env::new(&scenario, SEED, indices.clone(), Backend::Cpu).unwrap();
        let mut records = vec![Record::new(); indices.len()];
        for frame in 0..FRAMES {
            if let (FAULT_AT, true) = (frame, indices.contains(&FAULTY)) {
                let mut snapshots = env.snapshot();
                let place = (FAULTY - indices.start) as usize;
                snapshots[place] = with_fault(preset, &env.worlds()[place]).snapshot();
                env.restore(&snapshots).unwrap();
            }
            let observations = env.observe().unwrap();
            let prints: Vec<[u8; 32]> =
                env.worlds().iter().zip(&observations).map(|(world, o)| fingerprint(world, o)).collect();
            let commands: Vec<Command> = indices.clone().map(|index| command(index, frame)).collect();
            let events = env.step(&commands).unwrap();
            for (record, entry) in records.iter_mut().zip(prints.into_iter().zip(events)) {
                record.push(entry);
            }
        }
        records
    })
}

fn assert_independent(preset: Preset, threads: &[usize], groups: &[Range<u32>]) {
    let alone: Vec<Record> = (0..8).map(|index| alone(preset, index)).collect();
    for &threads in threads {
        for indices in groups {
            for (index, record) in indices.clone().zip(together(preset, indices.clone(), threads)) {
                let differs = record.iter().zip(&alone[index as usize]).position(|(a, b)| a != b);
                assert_eq!(
                    differs, None,
                    "frame in which world {index} of {indices:?}, {threads} threads, differs"
                );
            }
        }
    }
}

#[test]
fn worlds_are_independent() {
    assert_independent(Preset::Paper, &[1, 2, 4], &[3..4, 3..6, 0..8]);
}

#[test]
fn randomised_worlds_are_independent() {
    assert_independent(Preset::Randomised, &[2], &[3..6, 0..8]);
}

/// A snapshot of another world is refused with its index, and no world is restored.
#[test]
fn an_env_takes_its_own_snapshots() {
    let mut env = Env::new(&Scenario::of(&[]).unwrap(), SEED, 0..2, Backend::Cpu).unwrap();
    let start = env.snapshot();
    let commands = [command(0, 0), command(1, 0)];
    env.step(&commands).unwrap();
    let swapped = [start[0].clone(), start[0].clone()];
    let refusal = env.restore(&swapped).unwrap_err().to_string();
    assert_eq!(
        refusal,
        "snapshot 1: the snapshot belongs to another world: it is a snapshot of world 0, this is world 1"
    );
    assert_eq!(env.restore(&start[..1]).unwrap_err().to_string(), "1 snapshots for 2 worlds");
    assert!(env.worlds().iter().all(|world| world.frame() == 1));
    env.restore(&start).unwrap();
    assert!(env.worlds().iter().all(|world| world.frame() == 0));
}
