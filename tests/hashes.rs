//! Hashes of the f64 state of five scenes after 10 s, the same on every processor.
//!
//! `state_hashes.txt` holds them. A change of physics, growth, robot or config changes them. After an intended
//! change, write the file anew,
//!
//! `cargo test -p orchard-tests --test suite hashes::write -- --ignored`
//!
//! and say so in `CHANGELOG.md` under "Results". The file is compiled in: the test's binary can be copied to another
//! machine of the same instruction set and run there.

use orchard_geometry::Vec3;
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_tests::{state_hash, watched_pick};
use orchard_world::truth::FruitState;
use orchard_world::{Status, World};
use rayon::prelude::*;
use std::sync::Arc;

const COMMITTED: &str = include_str!("state_hashes.txt");
const FRAMES: u32 = 600;

type Scene = (&'static str, fn() -> String);

const SCENES: [Scene; 5] = [
    ("kicked-tree", kicked_tree),
    ("falling-limb", falling_limb),
    ("canopy-ram", canopy_ram),
    ("scripted-pick", scripted_pick),
    ("rolling-fruit", rolling_fruit),
];

/// Runs a world for 10 s; `act` pushes before each frame and gives the command.
fn run(seed: u64, mut act: impl FnMut(&mut World, u32) -> Command) -> World {
    let mut world = World::new(Arc::new(Spec::paper()), Arc::new(RobotModel::paper()), seed, 0).unwrap();
    for frame in 0..FRAMES {
        let command = act(&mut world, frame);
        world.step(&command);
    }
    assert_eq!(*world.status(), Status::Running);
    world
}

fn hold() -> Command {
    RobotModel::paper().start_command()
}

/// A tree at rest for 2 s, then kicked at a scaffold's tip every second, the last time half a second before the end.
fn kicked_tree() -> String {
    let world = run(42, |world, frame| {
        let tip = world.skeleton().segments.iter().rposition(|s| s.order == 1).unwrap();
        let body = world.tree().bodies[tip].index();
        let kicks = frame >= 120 && frame % 60 < 30;
        let force = if kicks { Vec3::new(12.0, -9.0, -15.0) } else { Vec3::zeros() };
        world.data_mut().body_force_world[body] = force;
        hold()
    });
    assert!(world.data().v.iter().any(|v| v.abs() > 1e-3), "the tree stands still");
    state_hash(&world)
}

/// A scaffold breaks after 1 s and falls with its fruit.
fn falling_limb() -> String {
    let world = run(17, |world, frame| {
        if frame == 60 {
            let limb = world.skeleton().segments.iter().position(|s| s.order == 1).unwrap();
            world.break_branch(limb);
        }
        hold()
    });
    let on_ground = |p: &Vec3| p.z < 0.05;
    let debris = (0..world.tree().len()).filter(|&s| world.rupture().is_debris(s));
    let mut fallen = debris.map(|s| world.data().x_world_body(world.tree().bodies[s]).translation.vector);
    assert!(fallen.any(|p| on_ground(&p)), "nothing reached the ground");
    state_hash(&world)
}

/// The base drives into the canopy at 1.1 m/s.
fn canopy_ram() -> String {
    let mut touched = 0;
    let world = run(7, |world, _| {
        touched += usize::from(world.report().contacts.iter().any(|c| c.force_world != Vec3::zeros()));
        Command { base_velocity: [1.1, 0.0, 0.0], ..hold() }
    });
    assert!(touched > 60, "contact in {touched} frames");
    state_hash(&world)
}

/// The robot drives to a fruit, grips it and pulls.
fn scripted_pick() -> String {
    let (mut hash, mut gripped) = (None, false);
    watched_pick(&Spec::paper(), &RobotModel::paper(), 1, &mut |world, _| {
        if world.frame() <= FRAMES {
            gripped |= (0..world.fruit().len()).any(|i| world.is_held(i));
            hash = Some(state_hash(world));
        }
    });
    assert!(gripped, "nothing was gripped");
    hash.unwrap()
}

/// Six fruit are torn off sideways, fly and roll.
fn rolling_fruit() -> String {
    let world = run(3, |world, frame| {
        for i in 0..6 {
            let point = world.fruit().points[i].index();
            let pulls = frame >= 30 && world.data().tethered[point];
            let force = if pulls { Vec3::new(30.0, 20.0, 20.0) } else { Vec3::zeros() };
            world.data_mut().point_force_world[point] = force;
        }
        hold()
    });
    let dropped = world.fruit_truth().iter().filter(|f| f.state == FruitState::Dropped).count();
    assert_eq!(dropped, 6);
    state_hash(&world)
}

fn computed() -> String {
    let lines: Vec<String> = SCENES.par_iter().map(|(name, scene)| format!("{name} {}\n", scene())).collect();
    lines.concat()
}

#[test]
fn states_after_ten_seconds_have_the_committed_hashes() {
    let computed = computed();
    let differ: Vec<&str> = computed.lines().filter(|line| !COMMITTED.lines().any(|l| l == *line)).collect();
    assert!(
        differ.is_empty() && computed.lines().count() == COMMITTED.lines().count(),
        "These scenes end in another state than the one committed in tests/state_hashes.txt:\n  {}\n\
         After a change of physics, growth, robot or config that is meant to change results: write the file anew with\n  \
         cargo test -p orchard-tests --test suite hashes::write -- --ignored\n\
         and say so in CHANGELOG.md under \"Results\". Otherwise this machine or compiler computes other bits than \
         the one that wrote the file, which it must not.",
        differ.join("\n  ")
    );
}

#[test]
#[ignore = "overwrites the committed hashes"]
fn write() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/state_hashes.txt");
    std::fs::write(path, computed()).unwrap();
}
