//! The kernels on whatever device there is, against their twins and against the f64 worlds.

use std::sync::Arc;

use orchard_batch::{BatchEvent, Status, TreeEvent, TreeWorld};
use orchard_geometry::Vec3;
use orchard_spec::Spec;
use orchard_spec::randomisation::Mode;

use crate::layout::world;
use crate::memory::Memory;
use crate::trials::{Trial, errors, grown, state};
use crate::twin::vary_tests::{base_of, spec};
use crate::{Choice, Gpu, GpuBatch, GpuError, Options, Solver, Statistics};

/// A device, or none, which is said; `cargo xtask test` has a step that tells it again, and fails in CI.
pub(crate) fn device() -> Option<Gpu> {
    match Gpu::open(Choice::Any) {
        Ok(gpu) => Some(gpu),
        Err(GpuError::NoAdapter(why)) => {
            println!("SKIPPED: no graphics adapter ({why})");
            None
        }
        Err(e) => panic!("{e}"),
    }
}

/// The same operations in f32, apart from how a device rounds products and sums, for which compilers may put fused ones.
#[test]
fn kernels_do_what_their_twins_do() {
    let Some(gpu) = device() else { return };
    let (worlds, trial) = Trial::harsh(grown(6));
    let (mut twin, mut batch) =
        (Memory::new(&worlds, 4, Solver::Aba).unwrap(), GpuBatch::new(&gpu, &worlds).unwrap());
    trial.apply_to_twin(&mut twin);
    trial.apply_to_batch(&mut batch);
    for frame in 1..=20 {
        twin.frame();
        batch.advance(1);
        for index in 0..worlds.len() {
            let mut on_device = worlds[index].data().clone();
            batch.store(index, &mut on_device).unwrap();
            let by_twin = state(&twin, &worlds, index);
            let size = |x: &[f64]| x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let error = by_twin.q.iter().zip(&on_device.q).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            let error = error / size(&by_twin.q);
            // A limb that swings on a broken joint multiplies errors.
            let most = if frame < 6 { 1e-5 } else { 1e-2 };
            assert!(error < most, "world {index}, frame {frame}: {error:.1e}");
        }
    }
}

#[test]
fn pull_and_release_agrees_with_f64() {
    let Some(gpu) = device() else { return };
    let (mut worlds, pull) = Trial::gentle(grown(5));
    let mut batch =
        GpuBatch::with_options(&gpu, &worlds, Options { pushes_each: 8, ..Options::default() }).unwrap();
    for force in [Some(&pull), None] {
        let trial = force.cloned().unwrap_or_else(|| pull.released());
        trial.apply_to_batch(&mut batch);
        trial.apply_to_worlds(&mut worlds);
        batch.advance(30);
        for world in &mut worlds {
            (0..30).for_each(|_| assert_eq!(world.step(), []));
        }
        for (index, world) in worlds.iter().enumerate() {
            let mut data = world.data().clone();
            batch.store(index, &mut data).unwrap();
            let (q, v, tip) = errors(world, data);
            println!("world {index}: angle {q:.1e}, rate {v:.1e} rad/s, tip {tip:.1e} m");
            assert!(q < 5e-5 && v < 1e-4 && tip < 1e-5);
        }
    }
    assert_eq!(batch.events().unwrap(), []);
    let statistics = batch.statistics().unwrap();
    assert!(
        statistics.iter().all(|s| s.snapped == 0 && s.peak_moment > 0.01 && s.peak_moment < 1.0),
        "{statistics:?}"
    );
}

#[test]
fn what_comes_off_comes_off_in_the_same_frame() {
    let Some(gpu) = device() else { return };
    let (mut worlds, trial) = Trial::harsh(grown(6));
    let mut batch = GpuBatch::new(&gpu, &worlds).unwrap();
    trial.apply_to_batch(&mut batch);
    trial.apply_to_worlds(&mut worlds);
    let (mut happened, mut expected) = (Vec::new(), Vec::new());
    for frames in [1, 4, 15] {
        batch.advance(frames);
        happened.extend(batch.events().unwrap());
    }
    for (index, world) in worlds.iter_mut().enumerate() {
        for frame in 1..=20 {
            expected.extend(world.step().into_iter().map(|event| BatchEvent { frame, world: index, event }));
        }
    }
    expected.sort_unstable();
    assert_eq!(happened, expected);
    assert!(expected.iter().any(|e| matches!(e.event, TreeEvent::Snapped { .. })));
    let statistics = batch.statistics().unwrap();
    let all = |of: fn(&crate::Statistics) -> u32| statistics.iter().map(of).sum::<u32>() as usize;
    assert_eq!(all(|s| s.snapped) + all(|s| s.detached), expected.len());
}

/// A world has the same bits alone, in a batch of others, beside a world that breaks and beside one that is not finite.
#[test]
fn company_changes_no_bit() {
    let Some(gpu) = device() else { return };
    [Solver::Aba, Solver::ConjugateGradients]
        .into_iter()
        .for_each(|solver| company_changes_none(&gpu, solver));
}

fn company_changes_none(gpu: &Gpu, solver: Solver) {
    let (worlds, trial) = Trial::harsh(grown(5));
    let bits = |batch: &mut GpuBatch, index: usize, world: &TreeWorld| -> Vec<u64> {
        let mut data = world.data().clone();
        batch.store(index, &mut data).unwrap();
        let points = data.point_p_world.iter().chain(&data.point_v_world).flat_map(|v| v.iter());
        data.q.iter().chain(&data.v).chain(points).map(|x| x.to_bits()).collect()
    };
    let spread_over = |tiles: usize| {
        let options = Options { tiles: Some(tiles), solver, ..Options::default() };
        GpuBatch::with_options(gpu, &worlds, options).unwrap()
    };
    let mut together = spread_over(1);
    trial.apply_to_batch(&mut together);
    // World 4 blows up.
    together.pull(4, 0, Vec3::new(1e30, 0.0, 0.0));
    together.advance(20);
    for index in 0..4 {
        let mut alone =
            GpuBatch::with_options(gpu, &worlds[index..=index], Options { solver, ..Options::default() })
                .unwrap();
        trial.of_world(index).apply_to_batch(&mut alone);
        (0..4).for_each(|_| alone.advance(5));
        assert_eq!(
            bits(&mut together, index, &worlds[index]),
            bits(&mut alone, 0, &worlds[index]),
            "world {index}"
        );
    }
    for tiles in [2, 5] {
        let mut spread = spread_over(tiles);
        // Tiles of a block have rows of their own, and it is no longer for that.
        assert!((together.bytes() / 2..together.bytes()).contains(&spread.bytes()));
        trial.apply_to_batch(&mut spread);
        spread.advance(20);
        for (index, world) in worlds.iter().enumerate().take(4) {
            assert_eq!(bits(&mut together, index, world), bits(&mut spread, index, world));
        }
    }
    let events = together.events().unwrap();
    let stopped: Vec<_> =
        events.iter().filter(|e| matches!(e.event, TreeEvent::Quarantined { .. })).collect();
    assert_eq!(stopped.len(), 1, "{events:?}");
    assert_eq!(stopped[0].world, 4);
}

/// Worlds of one tree that lack some of its fruit: the others stand in the same rows, and every world has the bits that it has alone.
#[test]
fn worlds_may_lack_fruit() {
    let Some(gpu) = device() else { return };
    let spec = spec(Mode::DistinctDimensions, |_| 0.0);
    let skeleton = orchard_treegen::grow(&spec, 7, 0).unwrap();
    let planting = orchard_world::Planting::of_tree(Arc::new(spec), skeleton, 7, 0);
    let worlds = [0, 2, 3].map(|each: usize| {
        let hangs = |(k, _): &(usize, &_)| each == 0 || k % each != 0;
        let fruit = planting.fruit.iter().enumerate().filter(hangs).map(|(_, fruit)| fruit.clone()).collect();
        TreeWorld::new(planting.spec.clone(), &planting.skeleton, fruit).unwrap()
    });
    let (worlds, trial) = Trial::harsh(worlds.into());
    let run = |worlds: &[TreeWorld], trial: &Trial| {
        let mut batch = GpuBatch::new(&gpu, worlds).unwrap();
        trial.apply_to_batch(&mut batch);
        batch.advance(20);
        let numbers = (0..worlds.len()).map(|index| {
            let mut data = worlds[index].data().clone();
            batch.store(index, &mut data).unwrap();
            (data.q, data.v, data.point_p_world, data.point_v_world)
        });
        let numbers = numbers.collect::<Vec<_>>();
        (numbers, batch.statistics().unwrap(), batch.events().unwrap())
    };
    let (together, statistics, events) = run(&worlds, &trial);
    let detached = |of: &[Statistics]| of.iter().map(|world| world.detached).collect::<Vec<_>>();
    assert!(detached(&statistics).iter().all(|count| *count > 0) && !events.is_empty());
    for (index, world) in worlds.iter().enumerate() {
        let (alone, own, own_events) = run(std::slice::from_ref(world), &trial.of_world(index));
        assert_eq!((&together[index], statistics[index]), (&alone[0], own[0]), "world {index}");
        let of_world = events.iter().filter(|event| event.world == index).map(|event| event.event);
        assert!(of_world.eq(own_events.iter().map(|event| event.event)));
    }
}

#[test]
fn fruit_fall_and_lie_still() {
    let Some(gpu) = device() else { return };
    let mut worlds = grown(1);
    let mut batch = GpuBatch::new(&gpu, &worlds).unwrap();
    let plant = worlds[0].plant().clone();
    let (weight, point) = (20.0, plant.fruit.points[0].index());
    let pull = |batch: &mut GpuBatch, world: &mut TreeWorld, force: f64| {
        let force = Vec3::new(0.0, 0.0, -force);
        batch.pull(0, 0, force);
        world.data_mut().point_force_world[point] = force;
    };
    pull(&mut batch, &mut worlds[0], 3.0 * weight);
    batch.advance(12);
    (0..12).for_each(|_| drop(worlds[0].step()));
    pull(&mut batch, &mut worlds[0], 0.0);
    batch.advance(240);
    (0..240).for_each(|_| drop(worlds[0].step()));
    let mut data = worlds[0].data().clone();
    batch.store(0, &mut data).unwrap();
    assert!(!data.tethered[point]);
    let (p, radius) = (data.point_p_world[point], plant.fruit.fruit[0].radius);
    // Its weight over the stiffness is 6 um; f32 has 4 nm there.
    assert!(
        (p.z - radius).abs() < 1e-4 && data.point_v_world[point].norm() < 1e-3,
        "{p} {}",
        data.point_v_world[point]
    );
    assert!((p - worlds[0].data().point_p_world[point]).norm() < 0.05, "{p}");
}

#[test]
fn worlds_that_do_not_fit_together_are_named() {
    let Some(gpu) = device() else { return };
    let mut worlds = grown(2);
    worlds[1].break_branch(5);
    let e = GpuBatch::new(&gpu, &worlds).unwrap_err().to_string();
    assert!(e.starts_with("world 1 has broken limbs"), "{e}");
    let mut spec = Spec::paper();
    spec.sim.gravity = spec.sim.gravity.with_value(1.6).unwrap();
    let other = TreeWorld::grow(Arc::new(spec), 7, 1).unwrap();
    let worlds = [worlds.remove(0), other];
    let e = GpuBatch::new(&gpu, &worlds).unwrap_err().to_string();
    assert!(e.starts_with("world 1 has another substep, gravity or rules"), "{e}");
}

/// Every world of a batch has the damping of its own wood.
#[test]
fn worlds_differ_in_damping() {
    let Some(gpu) = device() else { return };
    let damped = |factor: f64| {
        let mut spec = Spec::paper();
        let damping = &mut spec.wood.damping_time;
        *damping = damping.with_value(damping.value() * factor).unwrap();
        TreeWorld::grow(Arc::new(spec), 7, 0).unwrap()
    };
    let (mut worlds, trial) = Trial::gentle([0.5, 1.0, 2.0].map(damped).into());
    let mut batch =
        GpuBatch::with_options(&gpu, &worlds, Options { pushes_each: 8, ..Options::default() }).unwrap();
    trial.apply_to_batch(&mut batch);
    trial.apply_to_worlds(&mut worlds);
    batch.advance(30);
    let mut speeds = Vec::new();
    for (index, world) in worlds.iter_mut().enumerate() {
        (0..30).for_each(|_| assert_eq!(world.step(), []));
        let mut found = world.data().clone();
        batch.store(index, &mut found).unwrap();
        speeds.push(found.v.iter().map(|v| v * v).sum::<f64>());
        let (q, ..) = errors(world, found);
        assert!(q < 5e-5, "world {index}: {q}");
    }
    assert!(speeds[0] > 1.2 * speeds[1] && speeds[1] > 1.2 * speeds[2], "{speeds:?}");
}

/// A device whose memory others have taken: what does not fit is refused, with a size that does, and the device goes on.
#[test]
#[ignore = "fills the memory of the graphics device: to be run alone"]
fn a_full_device_is_told() {
    const LARGE: u64 = 1 << 30;
    const FREE: u64 = 1 << 26;
    let Some(gpu) = device() else { return };
    if gpu.info().is_software {
        println!("SKIPPED: an adapter in software has the processor's memory");
        return;
    }
    let base = base_of(&spec(Mode::DistinctDimensions, |_| 1.0));
    let mut taken = Vec::new();
    let mut size = LARGE;
    while size >= FREE {
        let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let usage = wgpu::BufferUsages::STORAGE;
        let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
        let buffer = gpu.device.create_buffer(&descriptor);
        match pollster::block_on(scope.pop()) {
            None => taken.push(buffer),
            Some(_) => size /= 2,
        }
    }
    println!("{} buffers of at most {LARGE} bytes", taken.len());
    const MANY: u32 = 16384;
    let e = GpuBatch::randomised(&gpu, &base, MANY).unwrap_err();
    println!("{e}");
    let GpuError::OutOfMemory { worlds, fits, .. } = e else { panic!("{e}") };
    assert!(worlds == MANY as usize && fits < worlds);
    drop(GpuBatch::randomised(&gpu, &base, fits as u32).unwrap());
    drop(taken);
    gpu.wait().unwrap();
    let mut batch = GpuBatch::randomised(&gpu, &base, MANY).unwrap();
    batch.advance(1);
    assert!(batch.statistics().unwrap().iter().all(|world| world.energy.is_finite()));
}

/// A whole tree topples: its limbs end up on the ground, not below it, and lie still. With the same law, trees in lanes never have the end of a branch's axis
/// lower than 3.5 mm above the ground (`docs/computation/batch.md`); here what held a tip is forgotten for a substep when fruit come off.
#[test]
fn a_broken_tree_comes_to_rest_on_the_ground() {
    let Some(gpu) = device() else { return };
    let mut worlds = grown(1);
    let plant = worlds[0].plant().clone();
    let segment = 2;
    worlds[0].data_mut().v[plant.model.dofs(plant.tree.bodies[segment]).start] = 2.0;
    let mut batch = GpuBatch::new(&gpu, &worlds).unwrap();
    assert!(batch.push(0, segment, Vec3::new(0.0, -8000.0, 0.0), Vec3::zeros()));
    let (mut lowest, mut data) = (f64::INFINITY, worlds[0].data().clone());
    for _ in 0..60 {
        batch.advance(5);
        batch.store(0, &mut data).unwrap();
        orchard_multibody::forward_kinematics(&plant.model, &mut data);
        lowest = crate::trials::tips(&worlds[0], &data).iter().fold(lowest, |low, tip| low.min(tip.z));
    }
    let fastest = data.v.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    println!("lowest tip {lowest} m, fastest joint at the end {fastest} rad/s");
    assert!(batch.statistics().unwrap()[0].snapped > 0);
    assert!(lowest > 0.0 && lowest < 0.02, "{lowest}");
    assert!(fastest < 0.05, "{fastest}");
}

/// A reset on the device: as new, while the others do not notice, in its tile or in its block; also a world that had stopped.
#[test]
fn a_reset_world_is_as_new() {
    let Some(gpu) = device() else { return };
    [1, 4].into_iter().for_each(|tiles| a_reset_world_is_as_new_in(&gpu, tiles));
}

fn a_reset_world_is_as_new_in(gpu: &Gpu, tiles: usize) {
    let (worlds, trial) = Trial::harsh(grown(4));
    let options = Options { tiles: Some(tiles), ..Options::default() };
    let mut batch = GpuBatch::with_options(gpu, &worlds, options).unwrap();
    trial.apply_to_batch(&mut batch);
    batch.pull(3, 0, Vec3::new(1e30, 0.0, 0.0));
    batch.advance(20);
    assert!(batch.status(3).unwrap() != Status::Running);
    let of = |batch: &mut GpuBatch, index: usize| {
        let mut data = worlds[index].data().clone();
        batch.store(index, &mut data).unwrap();
        data
    };
    let before = of(&mut batch, 1);
    let left = batch.statistics().unwrap()[1];
    trial.released().apply_to_batch(&mut batch);
    batch.pull(3, 0, Vec3::zeros());
    batch.reset(&[0, 2, 3]);
    let after = of(&mut batch, 1);
    assert_eq!((before.q, before.v), (after.q, after.v));
    let fresh = grown(4);
    for frames in [0, 30] {
        batch.advance(frames);
        for index in [0, 2, 3] {
            let (q, v, tip) = errors(&fresh[index], of(&mut batch, index));
            println!("world {index}, {frames} frames: angle {q:.1e}, rate {v:.1e} rad/s, tip {tip:.1e} m");
            assert!(q < 5e-5 && v < 1e-4 && tip < 1e-5);
            assert_eq!(batch.status(index).unwrap(), Status::Running);
        }
    }
    let events = batch.events().unwrap();
    assert!(!events.is_empty() && events.iter().all(|event| event.world == 1), "{events:?}");
    let statistics = batch.statistics().unwrap();
    assert!([0, 2, 3].iter().all(|&index| statistics[index].snapped + statistics[index].detached == 0));
    assert!(statistics[1].snapped >= left.snapped && statistics[1].peak_moment >= left.peak_moment);
}

/// Energy and scripted forces, as the twins have them, whose tests hold them to f64.
#[test]
fn energies_and_scripted_forces_are_the_twins() {
    let Some(gpu) = device() else { return };
    let (worlds, _) = Trial::harsh(grown(3));
    let (mut twin, mut batch) =
        (Memory::new(&worlds, 4, Solver::Aba).unwrap(), GpuBatch::new(&gpu, &worlds).unwrap());
    let force = Vec3::new(0.0, 5.0, -2.0);
    assert!(twin.script(1, 20, force, Vec3::zeros(), 2..=3));
    assert!(batch.script(1, 20, force, Vec3::zeros(), 2..=3));
    for _ in 0..5 {
        twin.frame();
        twin.measure();
        batch.advance(1);
        for (index, statistics) in batch.statistics().unwrap().into_iter().enumerate() {
            let by_twin = f32::from_bits(twin.world_number(index, world::ENERGY));
            let error = (statistics.energy - by_twin).abs() / by_twin.abs().max(100.0);
            assert!(error < 1e-5, "world {index}: {} and {by_twin} J", statistics.energy);
        }
    }
}

#[test]
fn conjugate_gradients_do_what_their_twin_does() {
    let Some(gpu) = device() else { return };
    let (worlds, trial) = Trial::harsh(grown(3));
    let options = Options { solver: Solver::ConjugateGradients, ..Options::default() };
    let mut batch = GpuBatch::with_options(&gpu, &worlds, options).unwrap();
    let mut twin = Memory::new(&worlds, options.pushes_each, options.solver).unwrap();
    trial.apply_to_twin(&mut twin);
    trial.apply_to_batch(&mut batch);
    (0..5).for_each(|_| twin.frame());
    batch.advance(5);
    for (index, world) in worlds.iter().enumerate() {
        let mut on_device = world.data().clone();
        batch.store(index, &mut on_device).unwrap();
        let by_twin = state(&twin, &worlds, index);
        let size = by_twin.q.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let error = by_twin.q.iter().zip(&on_device.q).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(error < 1e-3 * size, "world {index}: {:.1e}", error / size);
    }
}

/// A batch that no buffer of the device can hold is refused with the number of worlds that would fit, and these do.
#[test]
fn a_batch_that_is_too_large_names_one_that_fits() {
    const LARGEST: u64 = 1 << 20;
    if device().is_none() {
        return;
    }
    let gpu = Gpu::open_with(Choice::Any, LARGEST).unwrap();
    let worlds: Vec<TreeWorld> = grown(1).into_iter().cycle().take(200).collect();
    let e = GpuBatch::new(&gpu, &worlds).unwrap_err();
    let GpuError::TooLarge { worlds: 200, needed, has: LARGEST, fits, .. } = e else { panic!("{e}") };
    assert!(needed > LARGEST && (32..200).contains(&fits), "{e}");
    assert!(e.to_string().contains(&format!("{fits} worlds like these would fit")), "{e}");
    let mut batch = GpuBatch::new(&gpu, &worlds[..fits]).unwrap();
    batch.advance(1);
    assert_eq!(batch.events().unwrap(), []);
}

/// A device that goes away is an error at whatever is read next, and what was to be filled stays as it was.
#[test]
fn a_lost_device_is_told() {
    let Some(gpu) = device() else { return };
    let worlds = grown(1);
    let mut batch = GpuBatch::new(&gpu, &worlds).unwrap();
    batch.advance(1);
    let mut data = worlds[0].data().clone();
    gpu.device.destroy();
    batch.advance(1);
    assert!(matches!(batch.wait(), Err(GpuError::Lost(_))), "{:?}", batch.wait());
    assert!(matches!(batch.store(0, &mut data), Err(GpuError::Lost(_))));
    assert!(matches!(batch.events(), Err(GpuError::Lost(_))));
    assert_eq!(data.q, worlds[0].data().q);
    let e = batch.statistics().unwrap_err().to_string();
    assert!(e.starts_with("the graphics device was lost"), "{e}");
}
