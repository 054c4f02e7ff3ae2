//! Broken wood on the device against worlds stepped alone.

use std::sync::Arc;

use crate::course::Course;
use crate::device::device;
use orchard_lockstep::{Lockstep, Turn};
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_world::{World, WorldEvent};

/// A world of the preset `paper`, after a change.
fn world_of(index: u32, change: impl FnOnce(&mut Spec)) -> World {
    let mut spec = Spec::paper();
    change(&mut spec);
    World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 20_250_704, index).unwrap()
}

/// Steps a world together with no other.
fn step(together: &mut Lockstep, world: &mut World, command: Command) {
    together.step(&mut [Turn { lane: 0, world, command, is_whole: true }]).unwrap();
}

fn snapped(world: &mut World) -> Option<usize> {
    world.drain_events().into_iter().find_map(|event| match event {
        WorldEvent::BranchSnapped { segment, .. } => Some(segment),
        _ => None,
    })
}

/// A limb that a force has broken off, high in the tree: its joint's segment.
fn break_limb(world: &mut World) -> usize {
    let tree = world.tree().clone();
    let height = |segment: usize| world.data().x_world_body(tree.bodies[segment]).translation.vector.z;
    let small = |segment: &usize| (3..8).contains(&tree.subtree(*segment).len());
    let high = (0..tree.len()).filter(|segment| tree.parent[*segment].is_some()).filter(small);
    let limb = high.max_by(|a, b| height(*a).total_cmp(&height(*b))).unwrap();
    let body = tree.bodies[limb].index();
    world.data_mut().body_force_world[body].z = -400.0;
    let command = RobotModel::paper().start_command();
    let broken = (0..60).find_map(|_| {
        world.step(&command);
        snapped(world)
    });
    world.data_mut().body_force_world[body].z = 0.0;
    broken.expect("the force breaks a joint")
}

/// Asserts that a limb turns as in another world, within 1 % of its largest rate so far, which it returns [rad/s].
fn assert_swings_as(world: &World, other: &World, limb: usize, largest: f64, frame: u32) -> f64 {
    let dofs = world.model().dofs(world.tree().bodies[limb]);
    let apart = dofs.clone().map(|dof| (world.data().v[dof] - other.data().v[dof]).abs());
    let apart = apart.fold(0.0, f64::max);
    let largest = dofs.map(|dof| other.data().v[dof].abs()).fold(largest, f64::max);
    assert!(apart < 0.01 * largest.max(0.1), "frame {frame}: {apart} rad/s of {largest}");
    largest
}

/// A broken limb that swings in the air moves as in f64, and the world stays on the device.
#[test]
fn a_broken_limb_swings_as_alone() {
    let mut world = world_of(1, |_| ());
    let Some(gpu) = device() else { return };
    let mut together = Lockstep::new(&gpu, std::slice::from_ref(&world), 1, 1).unwrap();
    let limb = break_limb(&mut world);
    together.enter(&[(0, &world)]).unwrap();
    let (mut alone, command) = (world.clone(), RobotModel::paper().start_command());
    let mut largest = 0.0_f64;
    for frame in 0..90 {
        step(&mut together, &mut world, command);
        alone.step(&command);
        largest = assert_swings_as(&world, &alone, limb, largest, frame);
    }
    assert!(largest > 0.5, "{largest}");
    for (a, b) in world.data().q.iter().zip(&alone.data().q) {
        assert!((a - b).abs() < 2e-3, "{a} {b}");
    }
    let ages = [&world, &alone].map(|world| world.rupture().breaks()[0].age);
    assert!((ages[0] - ages[1]).abs() < 1e-9, "{ages:?}");
    assert_eq!(together.tally().share_on_device(), 1.0, "{:?}", together.tally());
}

/// A broken limb is as old as the frames of its world, not as those of the lanes beside it: what holds it by its age swings as alone while another world takes four frames to its one.
#[test]
fn a_broken_limb_ages_by_its_own_frames() {
    let mut world = world_of(1, |_| ());
    let Some(gpu) = device() else { return };
    let mut beside = world_of(2, |_| ());
    let mut together = Lockstep::new(&gpu, &[world.clone(), beside.clone()], 2, 4).unwrap();
    let limb = break_limb(&mut world);
    together.enter(&[(0, &world), (1, &beside)]).unwrap();
    let (mut alone, command) = (world.clone(), RobotModel::paper().start_command());
    let mut largest = 0.0_f64;
    for frame in 0..40 {
        let mut courses = [(0, &mut world, 1), (1, &mut beside, 4)].map(|(lane, world, frames)| {
            let commands = vec![command; frames];
            Course { lane, world, commands, taken: 0 }
        });
        together.step(&mut courses).unwrap();
        assert_eq!(courses.map(|course| course.taken), [1, 4]);
        alone.step(&command);
        largest = assert_swings_as(&world, &alone, limb, largest, frame);
    }
    assert!(largest > 0.5, "{largest}");
}

/// A limb that the robot breaks off keeps its world on the device until it may touch the ground; a world that is put back to its start is whole there again.
#[test]
fn a_limb_that_the_robot_breaks_off_falls_on_the_device() {
    let mut world = world_of(4, |spec| {
        let start = &mut spec.episode.start;
        start.distance = start.distance.with_ends(1.0, 1.0).unwrap();
        start.heading = start.heading.with_ends(0.0, 0.0).unwrap();
        spec.wood.rupture_stress = spec.wood.rupture_stress.with_value(10.0).unwrap();
    });
    let Some(gpu) = device() else { return };
    let mut together = Lockstep::new(&gpu, std::slice::from_ref(&world), 1, 1).unwrap();
    together.enter(&[(0, &world)]).unwrap();
    let mut command = RobotModel::paper().start_command();
    command.base_velocity = [0.8, 0.05, 0.1];
    let broken = (0..30).find(|_| {
        step(&mut together, &mut world, command);
        snapped(&mut world).is_some()
    });
    assert!(broken.is_some(), "nothing broke");
    let on_device = |together: &Lockstep| together.tally().frames["device"];
    let before = on_device(&together);
    command.base_velocity = [-0.5, 0.0, 0.0];
    (0..30).for_each(|_| step(&mut together, &mut world, command));
    assert!(on_device(&together) > before + 5, "{:?}", together.tally());
    world.reset();
    together.renew(0);
    let mut alone = world.clone();
    let command = RobotModel::paper().start_command();
    for _ in 0..20 {
        step(&mut together, &mut world, command);
        alone.step(&command);
    }
    assert!(world.rupture().breaks().is_empty());
    for (a, b) in world.data().q.iter().zip(&alone.data().q) {
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
}
