//! A world does not notice its company: alone, or among any others on any number of threads, it gives the same bits,
//! beside a quarantined neighbour as well.

use orchard_env::{Backend, Env};
use orchard_robot::{Command, RobotModel};
use orchard_spec::{Preset, Spec};
use orchard_tests::fingerprint;
use orchard_world::{Status, World, WorldEvent};
use std::ops::Range;
use std::sync::Arc;

const SEED: u64 = 5;
const FRAMES: u32 = 60;
/// World that is spoilt, and when.
const SICK: u32 = 4;
const SPOILT_AT: u32 = 20;

/// Each world's robot does something else.
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

/// The same world with a joint that is no number.
fn spoilt(preset: Preset, of: &World) -> World {
    let mut sick = world(preset, SICK);
    sick.restore(&of.snapshot()).unwrap();
    let q = sick.model().qs(sick.tree().bodies[5]).start;
    sick.data_mut().q[q] = f64::NAN;
    let mut spoilt = world(preset, SICK);
    spoilt.restore(&sick.snapshot()).unwrap();
    spoilt
}

/// What a world shows and what happens in it, frame by frame.
type Story = Vec<([u8; 32], Vec<WorldEvent>)>;

fn alone(preset: Preset, index: u32) -> Story {
    let mut world = world(preset, index);
    let mut story = Story::new();
    for frame in 0..FRAMES {
        if (index, frame) == (SICK, SPOILT_AT) {
            world = spoilt(preset, &world);
        }
        let observation = world.observe();
        let print = fingerprint(&world, &observation);
        world.step(&command(index, frame));
        story.push((print, world.drain_events()));
    }
    assert_eq!(*world.status() == Status::Running, index != SICK);
    story
}

fn together(preset: Preset, indices: Range<u32>, threads: usize) -> Vec<Story> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let (spec, robot) = (Arc::new(Spec::preset(preset)), Arc::new(RobotModel::paper()));
        let mut env = Env::new(spec, robot, SEED, indices.clone(), Backend::Cpu).unwrap();
        let mut stories = vec![Story::new(); indices.len()];
        for frame in 0..FRAMES {
            if let (SPOILT_AT, true) = (frame, indices.contains(&SICK)) {
                let mut snapshots = env.snapshot();
                let place = (SICK - indices.start) as usize;
                snapshots[place] = spoilt(preset, &env.worlds()[place]).snapshot();
                env.restore(&snapshots).unwrap();
            }
            let observations = env.observe();
            let prints: Vec<[u8; 32]> =
                env.worlds().iter().zip(&observations).map(|(world, o)| fingerprint(world, o)).collect();
            let commands: Vec<Command> = indices.clone().map(|index| command(index, frame)).collect();
            let events = env.step(&commands).unwrap();
            for (story, entry) in stories.iter_mut().zip(prints.into_iter().zip(events)) {
                story.push(entry);
            }
        }
        stories
    })
}

fn assert_unnoticed(preset: Preset, threads: &[usize], companies: &[Range<u32>]) {
    let alone: Vec<Story> = (0..8).map(|index| alone(preset, index)).collect();
    for &threads in threads {
        for indices in companies {
            for (index, story) in indices.clone().zip(together(preset, indices.clone(), threads)) {
                let differs = story.iter().zip(&alone[index as usize]).position(|(a, b)| a != b);
                assert_eq!(
                    differs, None,
                    "frame in which world {index} of {indices:?}, {threads} threads, differs"
                );
            }
        }
    }
}

#[test]
fn worlds_do_not_notice_their_company() {
    assert_unnoticed(Preset::Paper, &[1, 2, 4], &[3..4, 3..6, 0..8]);
}

#[test]
fn randomised_worlds_do_not_either() {
    assert_unnoticed(Preset::Randomised, &[2], &[3..6, 0..8]);
}

/// A snapshot of another world is refused by its place, and nothing is restored.
#[test]
fn an_env_takes_its_own_snapshots() {
    let (spec, robot) = (Arc::new(Spec::paper()), Arc::new(RobotModel::paper()));
    let mut env = Env::new(spec, robot, SEED, 0..2, Backend::Cpu).unwrap();
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
