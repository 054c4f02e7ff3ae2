//! Picks in lockstep: the fruit that comes off stays in the hand on the device.

use std::sync::Arc;

use crate::device::device;
use crate::scripted::watched_pick;
use orchard_geometry::{Vec3, inverse_transform};
use orchard_lockstep::{Lockstep, Turn};
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_world::{World, WorldEvent};

/// Frames before the grip in which the device takes the world, frames in which the fruit is carried, and frames in which the hand opens and the fruit falls.
const CLOSING: u32 = 5;
const CARRY: u32 = 60;
const FALL: usize = 40;

/// Fruit and frame of an event of the wanted kind.
pub type Wanted = fn(&WorldEvent) -> Option<(usize, u32)>;

pub fn found(events: &[WorldEvent], wanted: Wanted) -> Vec<(usize, u32)> {
    events.iter().filter_map(wanted).collect()
}

pub fn detached(event: &WorldEvent) -> Option<(usize, u32)> {
    if let WorldEvent::FruitDetached { fruit, frame, .. } = event { Some((*fruit, *frame)) } else { None }
}

pub fn gripped(event: &WorldEvent) -> Option<(usize, u32)> {
    if let WorldEvent::FruitGripped { fruit, frame } = event { Some((*fruit, *frame)) } else { None }
}

pub fn fallen(event: &WorldEvent) -> Option<(usize, u32)> {
    if let WorldEvent::FingerContactEnded { fruit, frame } = event { Some((*fruit, *frame)) } else { None }
}

/// Place of a fruit in the hand.
pub fn p_tcp(world: &World, fruit: usize) -> Vec3 {
    let (data, point) = (world.data(), world.fruit().points[fruit].index());
    inverse_transform(&world.handle().x_world_tcp(data), &data.point_p_world[point])
}

/// The commands of a pick by script, from the closing of the fingers on, give on the device what they gave in f64: the fruit is gripped, comes off, stays in the hand while it is withdrawn, and falls when the hand opens.
/// Frames with the fruit in the hand are the device's.
#[test]
fn a_pick_holds_its_fruit_on_the_device() {
    const SEEDS: std::ops::Range<u64> = 0..12;
    let Some(gpu) = device() else { return };
    let (spec, robot) = (Spec::paper(), RobotModel::paper());
    for seed in SEEDS {
        let mut commands: Vec<Command> = Vec::new();
        let mut last = None;
        let pick = watched_pick(&spec, &robot, seed, &mut |world, command| {
            commands.push(*command);
            // The script takes the events in the end.
            last = Some(world.clone());
        });
        let (Some(pick), Some(mut last)) = (pick, last) else { continue };
        if !(pick.gripped && pick.detached && pick.held) {
            continue;
        }
        let events = last.drain_events();
        let ([(fruit, closed)], [(off, frame)]) =
            (&found(&events, gripped)[..], &found(&events, detached)[..])
        else {
            continue;
        };
        let (fruit, end) = (*fruit, frame + CARRY);
        if fruit != *off || end as usize > commands.len() {
            continue;
        }
        commands.truncate(end as usize);
        let opened = Command { finger_q: robot.start_command().finger_q, ..commands[commands.len() - 1] };
        commands.extend(std::iter::repeat_n(opened, FALL));
        let (before, commands) = commands.split_at((closed - CLOSING) as usize);
        let mut here = World::new(Arc::new(spec.clone()), Arc::new(robot.clone()), seed, 0).unwrap();
        before.iter().for_each(|command| here.step(command));
        here.drain_events();
        let mut there = here.clone();
        let mut together = Lockstep::new(&gpu, std::slice::from_ref(&there), 1, 1).unwrap();
        together.enter(&[(0, &there)]).unwrap();
        let (mut off_by, mut in_hand) = (f64::INFINITY, 0);
        for command in commands {
            here.step(command);
            let turn = Turn { lane: 0, world: &mut there, command: *command, is_whole: true };
            together.step(&mut [turn]).unwrap();
            let point = there.fruit().points[fruit].index();
            in_hand += u32::from(!there.data().tethered[point] && there.is_held(fruit));
            if there.frame() == end {
                off_by = (p_tcp(&there, fruit) - p_tcp(&here, fruit)).norm();
                assert_eq!(together.tally().share_on_device(), 1.0, "seed {seed}: {:?}", together.tally());
            }
        }
        let [of_f64, of_device] = [here.drain_events(), there.drain_events()];
        for (name, wanted) in
            [("gripped", gripped as Wanted), ("detached", detached), ("off the hand", fallen)]
        {
            let [a, b] = [&of_f64, &of_device].map(|events| found(events, wanted));
            let is_near = |(a, b): (&(usize, u32), &(usize, u32))| a.0 == b.0 && a.1.abs_diff(b.1) <= 2;
            let same = a.len() == b.len() && a.iter().zip(&b).all(is_near);
            assert!(same && !a.is_empty(), "seed {seed}, {name}: {a:?} in f64, {b:?} on the device");
        }
        assert!(in_hand > CARRY / 2, "seed {seed}: held for {in_hand} frames");
        assert!(off_by < 1e-3, "seed {seed}: in the hand it is off by {off_by} m");
        assert!(together.tally().free_fruit > 5, "seed {seed}: {:?}", together.tally());
        return;
    }
    panic!("no pick held its fruit in f64");
}
