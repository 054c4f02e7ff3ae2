//! Resets, which only batches on a graphics device have: a reset world is compared with an f64 world from its start.

use super::testing;
use super::worlds::{Errors, grown, kick, pull, push, state};
use orchard_batch::{Status, Stepper};
use orchard_geometry::Vec3;
use orchard_gpu::{Gpu, GpuBatch, Options};

/// Bounds of `validate gpu` on angle and tip, and the floor of rates in f32 ([`super::backends`]).
const ANGLE: f64 = 5e-5;
const RATE: f64 = 1e-4;
const TIP: f64 = 1e-5;
/// World that is not reset.
const OTHER: usize = 1;
/// Worlds that are reset; the last one is in quarantine before.
const RESET: [usize; 3] = [0, 2, 3];

/// A reset world is whole, at rest in the equilibrium that f64 finds, and continues as a new one does; the others keep their bits, in the same tile or in the same block of memory.
#[test]
fn a_reset_world_is_as_new() {
    let Some(gpu) = testing::device() else { return };
    [1, 4].into_iter().for_each(|tiles| reset_in(&gpu, tiles));
}

fn reset_in(gpu: &Gpu, tiles: usize) {
    let mut worlds = grown(4);
    kick(&mut worlds, 1.0);
    let options = Options { tiles: Some(tiles), ..Options::default() };
    let mut batch = GpuBatch::with_options(gpu, &worlds, options).unwrap();
    let inputs = |batch: &mut GpuBatch, worlds: &mut [_], part: f64, infinite: f64| {
        for (index, world) in worlds.iter_mut().enumerate() {
            let world: &mut orchard_batch::TreeWorld = world;
            let segment = world.plant().tree.len() / 3;
            push(world, batch, index, segment, [Vec3::new(0.0, 0.0, -400.0 * part), Vec3::zeros()]);
            pull(world, batch, index, 0, Vec3::new(0.0, 0.0, -60.0 * part));
        }
        batch.pull(3, 1, Vec3::new(infinite, 0.0, 0.0));
    };
    inputs(&mut batch, &mut worlds, 1.0, 1e30);
    batch.advance(20);
    assert_ne!(batch.status(3).unwrap(), Status::Running);
    let before = state(&mut batch, &worlds[OTHER], OTHER);
    let past = batch.statistics().unwrap()[OTHER];
    inputs(&mut batch, &mut worlds, 0.0, 0.0);
    batch.reset(&RESET);
    let after = state(&mut batch, &worlds[OTHER], OTHER);
    assert_eq!((before.q, before.v), (after.q, after.v));
    let mut fresh = grown(4);
    for frames in [0, 60] {
        Stepper::advance(&mut batch, frames);
        for index in RESET {
            (0..frames).for_each(|_| assert_eq!(fresh[index].step(), []));
            let errors = Errors::of(&fresh[index], &state(&mut batch, &fresh[index], index));
            let is_near = errors.angle < ANGLE && errors.rate < RATE && errors.tip < TIP;
            assert!(is_near, "world {index}, {frames} frames: {errors:?}");
            assert_eq!(batch.status(index).unwrap(), Status::Running);
        }
    }
    let events = batch.events().unwrap();
    assert!(!events.is_empty() && events.iter().all(|event| event.world == OTHER), "{events:?}");
    let statistics = batch.statistics().unwrap();
    assert!(RESET.iter().all(|&index| statistics[index].snapped + statistics[index].detached == 0));
    assert!(statistics[OTHER].snapped >= past.snapped && statistics[OTHER].peak_moment >= past.peak_moment);
}
