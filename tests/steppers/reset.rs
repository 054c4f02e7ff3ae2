//! Resets: a reset world is as in a new batch, and the other worlds keep their bits.

use super::backends::{Backend, Tolerance, backends};
use super::testing;
use super::trees::{Errors, bits, grown, in_wind, state, stemmed};
use orchard_batch::{BatchEvent, Status, Stepper, TreeEvent, TreeWorld};
use orchard_geometry::Vec3;
use orchard_gpu::{GpuBatch, Options};

/// World that is not reset.
const OTHER: usize = 1;
/// Worlds that are reset. The last one is in quarantine before.
const RESET: [usize; 3] = [0, 2, ILL];
const ILL: usize = 3;
/// Force on a limb of every world \[N\], and on its fruit 0 over the force that detaches it.
const LOAD: Vec3 = Vec3::new(0.0, 0.0, -400.0);
const PULL: f64 = 3.0;
/// Frames in which these forces break the limb and detach the fruit, and frames at rest after a reset.
const DAMAGE: u32 = 20;
/// Of these, the frames in which events are compared on stems that bend: later, bare stems on broken twigs whip so fast that they multiply any difference.
const ON_STEMS: u32 = 5;
/// Speed of the wind [m/s], which begins anew with a reset.
const WIND: f64 = 6.0;
const REST: u32 = 30;

/// The limb that is overloaded.
fn limb(world: &TreeWorld) -> usize {
    world.plant().tree.len() / 3
}

/// Breaks a limb and detaches a fruit of every world, except of one that turns non-finite.
fn damage(stepper: &mut dyn Stepper, worlds: &[TreeWorld]) {
    for (index, world) in worlds.iter().enumerate() {
        stepper.push(index, limb(world), LOAD, Vec3::zeros()).unwrap();
        let size = PULL * world.plant().fruit.fruit[0].detach_force;
        stepper.pull(index, 0, Vec3::new(0.0, 0.0, -size));
    }
    stepper.pull(ILL, 1, Vec3::new(f64::INFINITY, 0.0, 0.0));
    stepper.advance(DAMAGE);
}

/// Events of the worlds that are reset, or of the other, with their frames counted after the first ones.
fn events(stepper: &mut dyn Stepper, are_reset: bool, after: u32) -> Vec<BatchEvent> {
    let events = stepper.events().unwrap().into_iter();
    let of_these = events.filter(|event| RESET.contains(&event.world) == are_reset);
    of_these.map(|event| BatchEvent { frame: event.frame - after, ..event }).collect()
}

/// Broken limbs, detached fruit, forces and quarantine are gone; the same damage then has the same events as in a new batch.
#[test]
fn a_reset_world_is_as_in_a_new_batch() {
    for backend in backends() {
        is_as_in_a_new_batch(&backend, &grown(4), backend.reset, DAMAGE);
        if backend.is_slow {
            continue;
        }
        is_as_in_a_new_batch(&backend, &stemmed(4), backend.reset.on_stems(), ON_STEMS);
        is_as_in_a_new_batch(&backend, &in_wind(4, WIND), backend.reset.on_stems(), ON_STEMS);
    }
}

/// The events of the second damage are compared in its first frames.
fn is_as_in_a_new_batch(backend: &Backend, worlds: &[TreeWorld], tolerance: Tolerance, frames: u32) {
    let compared = |mut events: Vec<BatchEvent>| {
        events.retain(|event| event.frame <= REST + frames);
        events
    };
    let name = &backend.name;
    let [mut stepper, mut never_reset, mut fresh] = [(); 3].map(|()| backend.build(worlds));
    damage(&mut *stepper, worlds);
    damage(&mut *never_reset, worlds);
    assert_ne!(stepper.status(ILL).unwrap(), Status::Running, "{name}");
    stepper.reset(&RESET);
    // Unread events of a reset world are lost.
    assert_eq!(events(&mut *stepper, true, 0), [], "{name}");
    for frames in [0, REST] {
        for batch in [&mut stepper, &mut never_reset, &mut fresh] {
            batch.advance(frames);
        }
        let [kept, truth] =
            [&mut stepper, &mut never_reset].map(|batch| bits(&state(&mut **batch, &worlds[OTHER], OTHER)));
        assert_eq!(kept, truth, "{name}, {frames} frames");
        for index in RESET {
            let world = &worlds[index];
            assert_eq!(stepper.status(index).unwrap(), Status::Running, "{name}, world {index}");
            let [found, truth] = [&mut stepper, &mut fresh].map(|batch| state(&mut **batch, world, index));
            let errors = Errors::between(world, &found, &truth);
            let is_near = tolerance.admits(errors) && errors.fruit <= tolerance.tip;
            assert!(is_near, "{name}, world {index}, {frames} frames: {errors:?}");
            assert_eq!((found.tethered, found.groups), (truth.tethered, truth.groups), "{name}");
        }
    }
    for batch in [&mut stepper, &mut fresh] {
        damage(&mut **batch, worlds);
    }
    let expected = compared(events(&mut *fresh, true, 0));
    assert_eq!(compared(events(&mut *stepper, true, DAMAGE)), expected, "{name}");
    for index in [0, 2] {
        let has = |is: fn(&TreeEvent) -> bool| expected.iter().any(|e| e.world == index && is(&e.event));
        assert!(has(|event| matches!(event, TreeEvent::Snapped { .. })), "{name}: {expected:?}");
        assert!(has(|event| matches!(event, TreeEvent::Detached { .. })), "{name}: {expected:?}");
    }
}

/// On the device the other world keeps its bits in the same tile and in another tile of the same block of memory. Scripted forces on reset worlds are gone, and their counts start at zero.
#[test]
fn a_reset_on_the_device_clears_counts_and_scripts() {
    let Some(gpu) = testing::device() else { return };
    let worlds = grown(4);
    for tiles in [1, 4] {
        let options = Options { tiles: Some(tiles), ..Options::default() };
        let mut batch = GpuBatch::with_options(&gpu, &worlds, options).unwrap();
        damage(&mut batch, &worlds);
        assert!(batch.script(0, limb(&worlds[0]), LOAD, Vec3::zeros(), DAMAGE + 1..=2 * DAMAGE));
        let before = bits(&state(&mut batch, &worlds[OTHER], OTHER));
        let past = batch.statistics().unwrap()[OTHER];
        batch.reset(&RESET);
        assert_eq!(bits(&state(&mut batch, &worlds[OTHER], OTHER)), before, "{tiles} tiles");
        batch.advance(DAMAGE);
        let statistics = batch.statistics().unwrap();
        assert!(RESET.iter().all(|&index| statistics[index].snapped + statistics[index].detached == 0));
        let other = statistics[OTHER];
        assert!(past.snapped > 0 && other.snapped >= past.snapped && other.peak_moment >= past.peak_moment);
    }
}
