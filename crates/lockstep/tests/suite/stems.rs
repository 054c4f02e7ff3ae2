//! Trees as measured on the device against worlds stepped alone: dampers by ratio, fruit in clusters on stems that bend and wear.

use std::sync::Arc;

use crate::device::device;
use orchard_fruit::Release;
use orchard_geometry::Vec3;
use orchard_lockstep::{Lockstep, Turn};
use orchard_robot::{Command, RobotModel};
use orchard_spec::{Preset, Spec};
use orchard_world::{World, WorldEvent};

/// Worlds whose robot faces the trunk from a distance \[m\].
fn worlds_of(distance: f64, preset: Preset, count: u32) -> Vec<World> {
    let mut spec = Spec::preset(preset);
    let start = &mut spec.episode.start;
    start.distance = start.distance.with_ends(distance, distance).unwrap();
    start.heading = start.heading.with_ends(0.0, 0.0).unwrap();
    let (spec, robot) = (Arc::new(spec), Arc::new(RobotModel::paper()));
    (0..count).map(|index| World::new(spec.clone(), robot.clone(), 20_250_704, index).unwrap()).collect()
}

fn step(together: &mut Lockstep, worlds: &mut [World], command: Command) {
    let turns =
        worlds.iter_mut().enumerate().map(|(lane, world)| Turn { lane, world, command, is_whole: true });
    together.step(&mut turns.collect::<Vec<_>>()).unwrap();
}

/// Frame, way and tension with which a fruit came off in a world's latest frame.
fn came_off(world: &mut World, fruit: usize) -> Option<(u32, Option<Release>, f64)> {
    world.drain_events().into_iter().find_map(|event| match event {
        WorldEvent::FruitDetached { fruit: own, frame, tension, release } if own == fruit => {
            Some((frame, release, tension))
        }
        _ => None,
    })
}

/// A fruit that hangs alone on its spur and not on top of another.
fn lone_fruit(world: &World) -> usize {
    let fruit = &world.fruit().fruit;
    let place = |i: usize| world.data().point_p_world[world.fruit().points[i].index()];
    let nearest = |i: usize| {
        let others = (0..fruit.len()).filter(|other| *other != i);
        others.map(|other| (place(i) - place(other)).norm()).fold(f64::INFINITY, f64::min)
    };
    (0..fruit.len()).max_by(|a, b| nearest(*a).total_cmp(&nearest(*b))).unwrap()
}

/// A fruit that is pulled swings, wears its stem and comes off as in f64: in the same frame, by the same way, under the same tension; while nothing turns fast its world stays on the device.
#[test]
fn a_pulled_fruit_comes_off_as_alone() {
    const FRAMES: u32 = 120;
    let mut frames = Vec::new();
    for pull in [Vec3::new(0.0, 0.0, -0.25), Vec3::new(0.2, 0.2, -0.08)] {
        let mut worlds = worlds_of(1.6, Preset::Calibrated, 1);
        let Some(gpu) = device() else { return };
        let mut together = Lockstep::new(&gpu, &worlds, 1, 1).unwrap();
        let world = &mut worlds[0];
        let fruit = lone_fruit(world);
        let point = world.fruit().points[fruit].index();
        let strength = world.fruit().fruit[fruit].detach_force;
        world.data_mut().point_force_world[point] = pull * strength;
        together.enter(&[(0, world)]).unwrap();
        let (mut alone, command) = (world.clone(), RobotModel::paper().start_command());
        let mut seen = [None, None];
        for _ in 0..FRAMES {
            step(&mut together, &mut worlds, command);
            alone.step(&command);
            seen[0] = seen[0].or(came_off(&mut worlds[0], fruit));
            seen[1] = seen[1].or(came_off(&mut alone, fruit));
            if seen.iter().all(Option::is_some) {
                break;
            }
        }
        let [Some((frame, way, tension)), Some((frame_alone, way_alone, tension_alone))] = seen else {
            panic!("{pull}: it did not come off: {seen:?}, {:?}", together.tally());
        };
        assert!(frame.abs_diff(frame_alone) <= 1, "{seen:?}");
        assert!(way.is_some() && way == way_alone, "{seen:?}");
        // That of the frame's end here, and of the substep in which it gave way there.
        assert!((tension - tension_alone).abs() < 0.05 * tension_alone, "{seen:?}");
        assert!(together.tally().share_on_device() > 0.5, "{:?}", together.tally());
        frames.push(frame);
    }
    // The stem bears the weaker pull for a while.
    assert!(frames.iter().any(|frame| *frame > 6), "{frames:?}");
}

/// A world has the same bits in any company and lane, also while its fruit press on each other.
#[test]
fn company_changes_no_bit() {
    let samples = worlds_of(1.0, Preset::TallSpindle, 2);
    let Some(gpu) = device() else { return };
    let mut command = RobotModel::paper().start_command();
    command.base_velocity = [0.8, 0.05, 0.1];
    let mut few = Lockstep::new(&gpu, &samples, 1, 1).unwrap();
    let mut many = Lockstep::new(&gpu, &samples, 2, 1).unwrap();
    let mut one = vec![samples[1].clone()];
    let mut worlds = samples;
    few.enter(&[(0, &one[0])]).unwrap();
    for (lane, world) in worlds.iter().enumerate() {
        many.enter(&[(lane, world)]).unwrap();
    }
    for _ in 0..40 {
        step(&mut few, &mut one, command);
        step(&mut many, &mut worlds, command);
    }
    assert_eq!(one[0].state_digest(), worlds[1].state_digest());
    let tally = few.tally();
    assert!(tally.frames["device"] >= 5, "{tally:?}");
    assert!(one[0].wood_load().contact_impulse > 0.0, "it touched no wood");
}
