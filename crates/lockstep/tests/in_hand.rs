//! Picks in lockstep: the fruit that comes off stays in the hand on the device.

#[path = "../../gpu/tests/device/mod.rs"]
mod device;
#[path = "../../../tests/scripted.rs"]
mod scripted;

use std::sync::Arc;

use device::device;
use orchard_geometry::{Vec3, inverse_transform};
use orchard_lockstep::{Lockstep, Turn};
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_world::{World, WorldEvent};
use scripted::watched_pick;

/// Frames in which the hand opens and the fruit falls.
const FALL: u32 = 60;

/// Events of one kind, each with its fruit and frame.
fn found(events: &[WorldEvent], wanted: impl Fn(&WorldEvent) -> Option<(usize, u32)>) -> Vec<(usize, u32)> {
    events.iter().filter_map(wanted).collect()
}

fn detached(event: &WorldEvent) -> Option<(usize, u32)> {
    if let WorldEvent::FruitDetached { fruit, frame, .. } = event { Some((*fruit, *frame)) } else { None }
}

fn gripped(event: &WorldEvent) -> Option<(usize, u32)> {
    if let WorldEvent::FruitGripped { fruit, frame } = event { Some((*fruit, *frame)) } else { None }
}

fn dropped(event: &WorldEvent) -> Option<(usize, u32)> {
    if let WorldEvent::FruitDropped { fruit, frame, .. } = event { Some((*fruit, *frame)) } else { None }
}

/// Place of a fruit in the hand.
fn p_tcp(world: &World, fruit: usize) -> Vec3 {
    let (data, point) = (world.data(), world.fruit().points[fruit].index());
    inverse_transform(&world.handle().x_world_tcp(data), &data.point_p_world[point])
}

/// The commands of a pick by script give on the device what they gave in f64: the fruit is gripped, comes off, stays in the hand while it is withdrawn, and falls when the hand opens. Frames with the fruit in the hand
/// are the device's.
#[test]
fn a_pick_holds_its_fruit_on_the_device() {
    const SEEDS: std::ops::Range<u64> = 0..6;
    const WANTED: u32 = 2;
    let Some(gpu) = device() else { return };
    let (spec, robot) = (Spec::paper(), RobotModel::paper());
    let mut picks = 0;
    for seed in SEEDS {
        let (mut commands, mut events): (Vec<Command>, Vec<WorldEvent>) = (Vec::new(), Vec::new());
        let mut last = None;
        let pick = watched_pick(&spec, &robot, seed, &mut |world, command| {
            commands.push(*command);
            // The script looks for the events itself.
            last = Some(world.clone());
        });
        let (Some(pick), Some(mut here)) = (pick, last) else { continue };
        if !(pick.gripped && pick.detached && pick.held) {
            continue;
        }
        let opened = Command { finger_q: robot.start_command().finger_q, ..commands[commands.len() - 1] };
        commands.extend(std::iter::repeat_n(opened, FALL as usize));
        let carried = here.frame();
        let mut there = World::new(Arc::new(spec.clone()), Arc::new(robot.clone()), seed, 0).unwrap();
        events.extend(here.drain_events());
        let [(fruit, _)] = found(&events, gripped)[..] else { continue };
        let held = p_tcp(&here, fruit);
        (0..FALL).for_each(|_| here.step(&opened));
        events.extend(here.drain_events());

        let mut together = Lockstep::new(&gpu, std::slice::from_ref(&there), 1).unwrap();
        together.enter(0, &there).unwrap();
        let (mut off_by, mut in_hand) = (f64::INFINITY, 0);
        for command in &commands {
            let turn = Turn { lane: 0, world: &mut there, command: *command, is_whole: true };
            together.step(&mut [turn]).unwrap();
            let point = there.fruit().points[fruit].index();
            in_hand += u32::from(!there.data().tethered[point] && there.is_held(fruit));
            if there.frame() == carried {
                off_by = (p_tcp(&there, fruit) - held).norm();
                let tally = together.tally();
                assert!(!tally.frames.contains_key("loose_fruit"), "seed {seed}: {tally:?}");
            }
        }
        let of_device = there.drain_events();
        for (name, wanted) in [
            ("gripped", gripped as fn(&WorldEvent) -> Option<(usize, u32)>),
            ("detached", detached),
            ("dropped", dropped),
        ] {
            let [a, b] = [&events, &of_device].map(|events| found(events, wanted));
            let same =
                a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| a.0 == b.0 && a.1.abs_diff(b.1) <= 2);
            assert!(same && !a.is_empty(), "seed {seed}, {name}: {a:?} in f64, {b:?} on the device");
        }
        assert!(in_hand > 60, "seed {seed}: held for {in_hand} frames");
        assert!(off_by < 1e-3, "seed {seed}: in the hand it is off by {off_by} m");
        picks += 1;
        if picks == WANTED {
            return;
        }
    }
    panic!("{picks} picks held their fruit in f64");
}
