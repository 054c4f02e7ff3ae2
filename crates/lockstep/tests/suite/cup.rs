//! A suction cup in lockstep: the device draws its vacuum, and the events are those of f64.

use std::sync::Arc;

use crate::device::device;
use crate::in_hand::{Wanted, fallen, found, gripped, p_tcp};
use crate::laid::{FRUIT, laid_on_cup};
use orchard_geometry::Vec3;
use orchard_lockstep::{Lockstep, Turn};
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_world::WorldEvent;

/// Frames in which the cup draws its vacuum, in which the arm carries the fruit, and in which it vents and the fruit falls.
const SEAL: u32 = 40;
const CARRY: u32 = 60;
const FALL: u32 = 60;

fn lost(event: &WorldEvent) -> Option<(usize, u32)> {
    if let WorldEvent::SealLost { fruit, frame } = event { Some((*fruit, *frame)) } else { None }
}

/// A fruit is drawn to the cup, carried, and let go on the device as in f64: same events, same pressure, same place in the hand. All frames with it in the hand are the device's.
#[test]
fn a_cup_carries_its_fruit_on_the_device() {
    let Some(gpu) = device() else { return };
    let robot = RobotModel::named("rail-xarm6-suction").unwrap();
    let (mut here, start) = laid_on_cup(&Arc::new(Spec::paper()), &robot);
    let point = here.fruit().points[FRUIT].index();
    here.drain_events();
    let mut there = here.clone();
    let mut together = Lockstep::new(&gpu, std::slice::from_ref(&there), 1, 4).unwrap();
    together.enter(&[(0, &there)]).unwrap();
    for frame in 0..SEAL + CARRY + FALL {
        let mut command = Command { vacuum: f64::from(u8::from(frame < SEAL + CARRY)), ..start };
        let share = f64::from(frame.clamp(SEAL, SEAL + CARRY) - SEAL) / f64::from(CARRY);
        command.arm_q[0] += 0.3 * share;
        command.arm_q[4] += 0.4 * share;
        if frame == SEAL {
            // The cup bears the weight from here on.
            for world in [&mut here, &mut there] {
                world.data_mut().point_force_world[point] = Vec3::zeros();
            }
            together.enter(&[(0, &there)]).unwrap();
        }
        here.step(&command);
        together.step(&mut [Turn { lane: 0, world: &mut there, command, is_whole: true }]).unwrap();
        let [pressure, expected] = [&there, &here].map(|world| world.sense().cup_pressure);
        assert!((pressure - expected).abs() < 40.0, "frame {frame}: {pressure} Pa, {expected} Pa");
        if frame + 1 == SEAL + CARRY {
            assert!(there.is_held(FRUIT) && here.is_held(FRUIT), "it is not held");
            let off_by = (p_tcp(&there, FRUIT) - p_tcp(&here, FRUIT)).norm();
            assert!(off_by < 1e-3, "in the hand it is off by {off_by} m");
            assert_eq!(together.tally().share_on_device(), 1.0, "{:?}", together.tally());
        }
    }
    let [of_f64, of_device] = [here.drain_events(), there.drain_events()];
    for (name, wanted) in [("gripped", gripped as Wanted), ("let go", fallen)] {
        let [a, b] = [&of_f64, &of_device].map(|events| found(events, wanted));
        let is_near = |(a, b): (&(usize, u32), &(usize, u32))| a.0 == b.0 && a.1.abs_diff(b.1) <= 2;
        let same = a.len() == b.len() && a.iter().zip(&b).all(is_near);
        assert!(same && !a.is_empty(), "{name}: {a:?} in f64, {b:?} on the device");
    }
    assert_eq!([&of_f64, &of_device].map(|events| found(events, lost).len()), [0, 0]);
}
