//! Worlds in lockstep against worlds stepped alone.

use std::sync::Arc;

use crate::course::Course;
use crate::device::device;
use orchard_fruit::Phase;
use orchard_gpu::Gpu;
use orchard_lockstep::{Detail, Lockstep, LockstepError, Turn};
use orchard_robot::{Command, RobotModel};
use orchard_spec::{Preset, Spec};
use orchard_world::{World, WorldEvent};

/// Worlds whose robot stands near the trunk and faces it, with the hand in the canopy's border.
fn worlds_of(spec: Spec, count: u32) -> Vec<World> {
    worlds_at(1.0, spec, count)
}

/// Worlds whose robot stands at a distance \[m\] from the trunk and faces it.
fn worlds_at(distance: f64, spec: Spec, count: u32) -> Vec<World> {
    let mut spec = spec;
    let start = &mut spec.episode.start;
    start.distance = start.distance.with_ends(distance, distance).unwrap();
    start.heading = start.heading.with_ends(0.0, 0.0).unwrap();
    let (spec, robot) = (Arc::new(spec), Arc::new(RobotModel::paper()));
    (0..count).map(|index| World::new(spec.clone(), robot.clone(), 20_250_704, index).unwrap()).collect()
}

/// Frames that worlds take at once.
const FRAMES: usize = 4;

fn together_of(gpu: &Gpu, worlds: &[World], lanes: usize) -> Lockstep {
    Lockstep::new(gpu, worlds, lanes, FRAMES).unwrap()
}

/// Drives to the tree with a moving arm.
fn command_at(frame: u32) -> Command {
    let mut command = RobotModel::paper().start_command();
    let share = f64::from(frame.min(90)) / 90.0;
    command.arm_q[0] += 0.4 * share;
    command.arm_q[3] += 0.3 * share;
    command.base_velocity = [0.8, 0.05, 0.1];
    command
}

fn step_all(together: &mut Lockstep, worlds: &mut [World], command: Command) {
    let turns =
        worlds.iter_mut().enumerate().map(|(lane, world)| Turn { lane, world, command, is_whole: true });
    together.step(&mut turns.collect::<Vec<_>>()).unwrap();
}

/// Largest difference of the robots' coordinates.
fn robot_apart(a: &World, b: &World) -> f64 {
    let qs = a.handle().bodies.iter().flat_map(|&body| a.model().qs(body));
    qs.map(|q| (a.data().q[q] - b.data().q[q]).abs()).fold(0.0, f64::max)
}

#[test]
fn a_world_moves_as_alone_until_it_touches_something() {
    let Some(gpu) = device() else { return };
    let mut worlds = worlds_at(1.2, Spec::paper(), 3);
    let mut together = together_of(&gpu, &worlds, 3);
    let mut alone = worlds.clone();
    for (lane, world) in worlds.iter().enumerate() {
        together.enter(&[(lane, world)]).unwrap();
    }
    for frame in 0..30 {
        let command = command_at(frame);
        step_all(&mut together, &mut worlds, command);
        alone.iter_mut().for_each(|world| world.step(&command));
    }
    assert_eq!(together.tally().share_on_device(), 1.0, "{:?}", together.tally());
    for (world, alone) in worlds.iter().zip(&alone) {
        assert_eq!(world.frame(), alone.frame());
        assert!(robot_apart(world, alone) < 1e-4, "{}", robot_apart(world, alone));
        let (seen, expected) = (world.sense(), alone.sense());
        let torque = (0..seen.arm_q.len()).map(|k| (seen.arm_torque[k] - expected.arm_torque[k]).abs());
        // Servos of 600 N m/rad turn a rounding of 1e-6 rad into some hundredths.
        let torque = torque.fold(0.0, f64::max);
        assert!(torque < 0.05, "{torque}");
        for point in &alone.fruit().points {
            let at = point.index();
            let apart = (world.data().point_p_world[at] - alone.data().point_p_world[at]).norm();
            assert!(apart < 1e-4, "fruit {at}: {apart}");
        }
    }
}

/// Over ruts and bumps the chassis rises and sinks on the device as alone, by a height that is foreseen for a frame.
#[test]
fn a_robot_drives_over_uneven_ground_as_alone() {
    let Some(gpu) = device() else { return };
    let mut spec = Spec::paper();
    spec.terrain.enabled = true;
    spec.terrain.amplitude = spec.terrain.amplitude.with_value(0.1).unwrap();
    let mut worlds = worlds_at(2.2, spec, 2);
    let mut together = together_of(&gpu, &worlds, 2);
    let mut alone = worlds.clone();
    for (lane, world) in worlds.iter().enumerate() {
        together.enter(&[(lane, world)]).unwrap();
    }
    let height = |world: &World| world.sense().base_height;
    let (mut lowest, mut highest) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for frame in 0..90 {
        let mut command = command_at(frame);
        command.base_velocity = [if frame < 45 { -0.8 } else { 0.3 }, 0.3, 0.4];
        step_all(&mut together, &mut worlds, command);
        for (k, (world, alone)) in worlds.iter().zip(&mut alone).enumerate() {
            alone.step(&command);
            let [own, expected] = [world, &*alone].map(height);
            // The base's acceleration, of up to 1 m/s2, is not foreseen.
            assert!((own - expected).abs() < 3e-4, "world {k}, frame {frame}: {own} m, {expected} m");
            (lowest[k], highest[k]) = (lowest[k].min(own), highest[k].max(own));
        }
    }
    for (k, (world, alone)) in worlds.iter().zip(&alone).enumerate() {
        assert!(highest[k] - lowest[k] > 0.01, "world {k}: from {} to {} m", lowest[k], highest[k]);
        assert!(robot_apart(world, alone) < 2e-5, "world {k}: {}", robot_apart(world, alone));
    }
    assert_eq!(together.tally().share_on_device(), 1.0, "{:?}", together.tally());
}

/// A world has the same bits in any company, in any lane, and with others coming and going beside it.
#[test]
fn company_changes_no_bit() {
    let Some(gpu) = device() else { return };
    let samples = worlds_of(Spec::paper(), 3);
    let mut few = together_of(&gpu, &samples, 1);
    let mut many = together_of(&gpu, &samples, 3);
    let mut one = samples[1].clone();
    few.enter(&[(0, &one)]).unwrap();
    let mut worlds = samples.clone();
    worlds.rotate_left(2);
    for (lane, world) in worlds.iter().enumerate() {
        many.enter(&[(lane, world)]).unwrap();
    }
    for frame in 0..50 {
        let command = command_at(frame);
        // The frames of both are under way at once.
        let mut alone = [Turn { lane: 0, world: &mut one, command, is_whole: true }];
        let of_one = few.begin(&mut alone).unwrap();
        let mut turns: Vec<_> = worlds
            .iter_mut()
            .enumerate()
            .map(|(lane, world)| Turn { lane, world, command, is_whole: true })
            .collect();
        let of_many = many.begin(&mut turns).unwrap();
        few.end(&mut alone, of_one).unwrap();
        many.end(&mut turns, of_many).unwrap();
        if frame % 20 == 7 {
            // Another tree beside it.
            worlds[0] = samples[(frame / 20) as usize].clone();
            many.enter(&[(0, &worlds[0])]).unwrap();
        }
    }
    assert!(one.wood_load().contact_impulse > 0.0, "it touched no wood");
    assert_eq!(one.state_digest(), worlds[2].state_digest());
}

/// Loads of the wood are the same but for the rounding of those that the device tells.
fn assert_same_load(world: &World, other: &World) {
    let (load, told) = (world.wood_load(), other.wood_load());
    assert_eq!(load.contact_impulse, told.contact_impulse);
    assert_eq!(load.peak_contact_force, told.peak_contact_force);
    // Rises of 5e-6 are not told.
    assert!((load.peak_ratio - told.peak_ratio).abs() < 1e-5 * load.peak_ratio, "{load:?} {told:?}");
    assert!((load.excess - told.excess).abs() < 1e-5, "{load:?} {told:?}");
    assert!((load.excess_integral - told.excess_integral).abs() < 1e-5, "{load:?} {told:?}");
}

/// Frames after which only the robot is brought back change nothing but the rounding of the load that the device tells.
#[test]
fn calm_frames_leave_the_tree_behind_and_change_nothing() {
    let Some(gpu) = device() else { return };
    let samples = worlds_of(Spec::paper(), 2);
    let mut whole = together_of(&gpu, &samples, 2);
    let mut lazy = together_of(&gpu, &samples, 2);
    let mut all = [samples.clone(), samples];
    for (together, worlds) in [&mut whole, &mut lazy].into_iter().zip(&all) {
        for (lane, world) in worlds.iter().enumerate() {
            together.enter(&[(lane, world)]).unwrap();
        }
    }
    let [ahead, behind] = &mut all;
    let (mut were_behind, mut touched) = (0, 0);
    for frame in 0..60 {
        // It drives into the tree, and back.
        let mut command = command_at(frame);
        if frame >= 45 {
            command.base_velocity = [-0.8, 0.0, 0.0];
        }
        step_all(&mut whole, ahead, command);
        let turns =
            behind.iter_mut().enumerate().map(|(lane, world)| Turn { lane, world, command, is_whole: false });
        lazy.step(&mut turns.collect::<Vec<_>>()).unwrap();
        for (world, other) in ahead.iter_mut().zip(&mut *behind) {
            assert!(!world.is_behind());
            were_behind += u32::from(other.is_behind());
            touched += u32::from(!world.report().contacts.is_empty());
            assert_eq!(world.frame(), other.frame());
            assert_eq!(robot_apart(world, other), 0.0, "frame {frame}");
            assert_eq!(world.drain_events(), other.drain_events(), "frame {frame}");
            assert_same_load(world, other);
            let [tension, told] = [&*world, &*other].map(|world| world.fruit_lives().peak_tension());
            assert!((tension - told).abs() < 1e-3 * tension.max(1.0), "frame {frame}: {tension} {told}");
            for fruit in 0..world.fruit().len() {
                assert_eq!(world.fruit_bruise(fruit), other.fruit_bruise(fruit), "frame {frame}");
            }
        }
        if frame % 20 == 19 {
            let mut given: Vec<_> = behind.iter_mut().enumerate().collect();
            lazy.catch_up(&mut given).unwrap();
            for (world, other) in ahead.iter().zip(&*behind) {
                assert!(!other.is_behind());
                assert_eq!(world.data().q, other.data().q, "frame {frame}");
                assert_eq!(world.data().v, other.data().v, "frame {frame}");
                assert_eq!(world.data().point_p_world, other.data().point_p_world, "frame {frame}");
                assert_eq!(world.data().point_v_world, other.data().point_v_world, "frame {frame}");
                let poses = |world: &World| {
                    let bodies = world.model().body_ids();
                    bodies.map(|body| *world.data().x_world_body(body)).collect::<Vec<_>>()
                };
                assert_eq!(poses(world), poses(other), "frame {frame}");
            }
        }
    }
    assert!(ahead.iter().any(|world| world.wood_load().contact_impulse > 0.0), "they touched no wood");
    assert!(were_behind > 40 && touched > 20, "{were_behind} {touched}");
    assert_eq!(u64::from(were_behind), lazy.tally().calm, "{:?}", lazy.tally());
    assert_eq!(whole.tally().calm, 0);
}

/// Frames that are given together have the bits of frames that are given one by one, also where the robot touches wood in them; those after a fruit came off are computed here.
#[test]
fn frames_given_together_change_no_bit() {
    let Some(gpu) = device() else { return };
    let samples = worlds_of(Spec::paper(), 3);
    let mut single = together_of(&gpu, &samples, 3);
    let mut many = together_of(&gpu, &samples, 3);
    let mut all = [samples.clone(), samples];
    for (together, worlds) in [&mut single, &mut many].into_iter().zip(&all) {
        for (lane, world) in worlds.iter().enumerate() {
            together.enter(&[(lane, world)]).unwrap();
        }
    }
    let command_of = |lane: usize, frame: u32| {
        let mut command = command_at(frame);
        // They meet the tree at different times, and back out.
        command.base_velocity[0] = if frame < 40 { 0.8 - 0.1 * lane as f64 } else { -0.8 };
        command
    };
    let [one_by_one, together] = &mut all;
    let (mut came_off, mut touched, mut rounds) = ([false; 3], 0, 0);
    for first in (0..60).step_by(FRAMES) {
        let frames = first as u32..(first + FRAMES) as u32;
        for frame in frames.clone() {
            let turns = one_by_one.iter_mut().enumerate().map(|(lane, world)| {
                let command = command_of(lane, frame);
                Turn { lane, world, command, is_whole: false }
            });
            single.step(&mut turns.collect::<Vec<_>>()).unwrap();
        }
        let mut courses: Vec<Course<'_>> = together
            .iter_mut()
            .enumerate()
            .map(|(lane, world)| {
                let commands = frames.clone().map(|frame| command_of(lane, frame)).collect();
                Course { lane, world, commands, taken: 0 }
            })
            .collect();
        while !courses.is_empty() {
            many.step(&mut courses).unwrap();
            rounds += 1;
            courses.retain(|course| !course.commands[course.taken..].is_empty());
        }
        for (lane, (world, other)) in one_by_one.iter_mut().zip(&mut *together).enumerate() {
            assert_eq!(world.frame(), other.frame());
            let (events, others) = (world.drain_events(), other.drain_events());
            came_off[lane] |= events.iter().any(|event| matches!(event, WorldEvent::FruitDetached { .. }));
            if came_off[lane] {
                // The frames after that in a span are computed here.
                assert!(robot_apart(world, other) < 1e-3, "world {lane}, frame {first}");
                continue;
            }
            touched += u32::from(!world.report().contacts.is_empty());
            assert_eq!(robot_apart(world, other), 0.0, "world {lane}, frame {first}");
            assert_eq!(events, others, "world {lane}, frame {first}");
            assert_same_load(world, other);
            let [a, b] = [&*world, &*other].map(World::sense);
            assert_eq!(
                (a.arm_torque, a.base_pose),
                (b.arm_torque, b.base_pose),
                "world {lane}, frame {first}"
            );
        }
    }
    for (together, worlds) in [(&mut single, &mut *one_by_one), (&mut many, &mut *together)] {
        together.catch_up(&mut worlds.iter_mut().enumerate().collect::<Vec<_>>()).unwrap();
    }
    assert!(rounds < 40, "{rounds} rounds for 60 frames");
    assert!(touched > 3 && came_off.contains(&true), "{touched} {came_off:?}");
    for ((world, other), _) in
        one_by_one.iter().zip(&*together).zip(came_off).filter(|(_, came_off)| !came_off)
    {
        assert_eq!(world.data().q, other.data().q);
        assert_eq!(world.data().v, other.data().v);
        assert_eq!(world.data().point_p_world, other.data().point_p_world);
    }
    let tally = many.tally();
    assert!(tally.calm > 20 && tally.frames.contains_key("came_off"), "{tally:?}");
}

/// A fruit that comes off on the device falls, lands and lies still as in a world stepped alone, and its world stays on the device.
#[test]
fn a_fruit_falls_as_alone() {
    let Some(gpu) = device() else { return };
    let mut worlds = worlds_of(Spec::paper(), 1);
    let mut together = together_of(&gpu, &worlds, 1);
    together.enter(&[(0, &worlds[0])]).unwrap();
    let point = worlds[0].fruit().points[0].index();
    let command = RobotModel::paper().start_command();
    worlds[0].data_mut().point_force_world[point].z = -200.0;
    together.renew(0);
    let mut pulled = 0;
    while worlds[0].data().tethered[point] {
        step_all(&mut together, &mut worlds, command);
        pulled += 1;
        assert!(pulled < 60, "it hangs on");
    }
    worlds[0].data_mut().point_force_world[point].z = 0.0;
    worlds[0].drain_events();
    let mut alone = worlds[0].clone();
    let mut frames = 0;
    while !matches!(alone.fruit_lives().phase(0), Phase::Asleep(_)) {
        step_all(&mut together, &mut worlds, command);
        alone.step(&command);
        let [p, expected] = [&worlds[0], &alone].map(|world| world.data().point_p_world[point]);
        assert!((p - expected).norm() < 1e-4, "frame {frames}: {p} {expected}");
        frames += 1;
        assert!(frames < 600, "it rolls on");
    }
    let [events, expected] = [&mut worlds[0], &mut alone].map(|world| {
        let of_fruit = |event: &WorldEvent| match event {
            WorldEvent::FruitDropped { fruit, frame, .. } | WorldEvent::FruitImpact { fruit, frame, .. } => {
                Some((*fruit, *frame))
            }
            _ => None,
        };
        world.drain_events().iter().filter_map(of_fruit).collect::<Vec<_>>()
    });
    assert!(!expected.is_empty() && events == expected, "{events:?} {expected:?}");
    assert!(matches!(worlds[0].fruit_lives().phase(0), Phase::Asleep(_)));
    assert_eq!(together.tally().share_on_device(), 1.0, "{:?}", together.tally());
    assert!(together.tally().free_fruit > 30, "{:?}", together.tally());
    // Beside a fruit that sleeps on the ground nothing is brought back.
    for _ in 0..6 {
        let turn = Turn { lane: 0, world: &mut worlds[0], command, is_whole: false };
        together.step(&mut [turn]).unwrap();
        alone.step(&command);
    }
    assert_eq!(together.tally().calm, 6, "{:?}", together.tally());
    assert!(robot_apart(&worlds[0], &alone) < 1e-5);
    let [p, expected] = [&worlds[0], &alone].map(|world| world.data().point_p_world[point]);
    assert!((p - expected).norm() < 1e-4, "{p} {expected}");
}

#[test]
fn the_times_of_a_frame_change_no_bit() {
    let Some(gpu) = device() else { return };
    let mut worlds = worlds_of(Spec::paper(), 2);
    let mut together = together_of(&gpu, &worlds, 2);
    let mut timed = worlds.clone();
    let mut watched = together_of(&gpu, &timed, 2);
    for (lane, (world, other)) in worlds.iter().zip(&timed).enumerate() {
        together.enter(&[(lane, world)]).unwrap();
        watched.enter(&[(lane, other)]).unwrap();
    }
    assert!(watched.profile().is_none());
    watched.keep_profile(Some(Detail::Kernels));
    for frame in 0..4 {
        step_all(&mut together, &mut worlds, command_at(frame));
        step_all(&mut watched, &mut timed, command_at(frame));
    }
    assert!(worlds.iter().zip(&timed).all(|(world, other)| robot_apart(world, other) == 0.0));
    let profile = watched.profile().unwrap();
    assert_eq!((profile.rounds, profile.solves.len()), (4, 2));
    for part in ["outlook", "submit", "wait", "read", "take_back"] {
        assert!(profile.host.contains_key(part), "{part}");
    }
    // Where the adapter has a clock.
    for (kernel, seconds) in &profile.device {
        assert!(*seconds >= 0.0, "{kernel}");
    }
    watched.keep_profile(None);
    assert!(watched.profile().is_none());
}

#[test]
fn what_a_user_can_get_wrong() {
    let worlds = worlds_of(Spec::paper(), 1);
    let Some(gpu) = device() else { return };
    let e = Lockstep::new(&gpu, &[], 1, 1).unwrap_err();
    assert!(matches!(e, LockstepError::Empty { samples: 0, lanes: 1 }), "{e}");
    assert!(Lockstep::new(&gpu, &worlds, 0, 1).is_err());
    // Lanes are for worlds of one wind.
    let mut windy = Spec::paper();
    windy.wind = Spec::preset(Preset::Calibrated).wind;
    let wind = windy.wind.as_mut().unwrap();
    wind.speed = wind.speed.with_value(6.0).unwrap();
    let windy = worlds_of(windy, 1);
    let e = Lockstep::new(&gpu, &worlds, 1, 1).unwrap().enter(&[(0, &windy[0])]).unwrap_err();
    assert!(e.to_string().contains("rules"), "{e}");
}
