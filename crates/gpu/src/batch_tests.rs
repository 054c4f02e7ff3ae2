//! Kernels on the device at hand, against the f64 worlds. The suite `steppers` of the workspace tests the interface that all batches share.

use std::sync::Arc;

use orchard_batch::{TreeEvent, TreeWorld};
use orchard_geometry::Vec3;
use orchard_multibody::energy;
use orchard_spec::Spec;
use orchard_spec::randomisation::Mode;

use crate::memory::Memory;
use crate::testing::device;
use crate::trees::{Errors, bits, grown, state, tips};
use crate::trials::{Trial, is_small};
use crate::twin::vary_tests::{base_of, spec};
use crate::{Choice, Gpu, GpuBatch, GpuError, Options, Solver, Statistics};

/// A world has the same bits alone, in a batch of others, beside a world that breaks and beside a world that is not finite.
#[test]
fn neighbours_change_no_bit() {
    let Some(gpu) = device() else { return };
    [Solver::Aba, Solver::ConjugateGradients]
        .into_iter()
        .for_each(|solver| neighbours_change_none(&gpu, solver));
}

fn neighbours_change_none(gpu: &Gpu, solver: Solver) {
    let (worlds, trial) = Trial::harsh(grown(5));
    let bits = |batch: &mut GpuBatch, index: usize, world: &TreeWorld| bits(&state(batch, world, index));
    let spread_over = |tiles: usize| {
        let options = Options { tiles: Some(tiles), solver, ..Options::default() };
        GpuBatch::with_options(gpu, &worlds, options).unwrap()
    };
    let mut together = spread_over(1);
    trial.apply_to_batch(&mut together);
    // World 4 turns non-finite.
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
        // Tiles of a block share its rows, so that more tiles need no more memory for links.
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

/// Tiles that share a block of memory keep to their own lanes, and blocks to their own rows.
#[test]
fn worlds_have_the_same_bits_in_tiles_of_their_own() {
    const WORLDS: usize = 18;
    let Some(gpu) = device() else { return };
    for solver in [Solver::Aba, Solver::ConjugateGradients] {
        let (worlds, trial) = Trial::harsh(grown(WORLDS as u32));
        let spread = Memory::spread_over(WORLDS, &worlds, 4, solver, None).unwrap();
        assert_eq!(
            (spread.tile_count(), spread.blocks_of(&(0..WORLDS).collect::<Vec<_>>()).len()),
            (WORLDS, 2)
        );
        let [mut together, mut spread] = [1, WORLDS].map(|tiles| {
            let options = Options { tiles: Some(tiles), solver, ..Options::default() };
            let mut batch = GpuBatch::with_options(&gpu, &worlds, options).unwrap();
            trial.apply_to_batch(&mut batch);
            batch.advance(3);
            batch
        });
        for (index, world) in worlds.iter().enumerate() {
            let [a, b] = [&mut together, &mut spread].map(|batch| state(batch, world, index));
            assert_eq!((a.q, a.v, a.point_p_world), (b.q, b.v, b.point_p_world), "world {index}");
        }
        assert_eq!(together.events().unwrap(), spread.events().unwrap());
    }
}

/// Worlds of one tree that lack some of its fruit: the other fruit have the same rows, and every world has the bits that it has alone.
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
    assert!(e.starts_with("world 1 has another substep, gravity, mean wind or rules"), "{e}");
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
        let errors = Errors::of(world, &found);
        assert!(errors.angle < 5e-5, "world {index}: {errors:?}");
    }
    assert!(speeds[0] > 1.2 * speeds[1] && speeds[1] > 1.2 * speeds[2], "{speeds:?}");
}

/// A device whose memory is full: a batch that does not fit is refused with a number of worlds that would fit, and the device keeps working.
#[test]
#[ignore = "fills the memory of the graphics device: to be run alone"]
fn a_full_device_is_an_error() {
    const LARGE: u64 = 1 << 30;
    const FREE: u64 = 1 << 26;
    let Some(gpu) = device() else { return };
    if gpu.info().is_software {
        println!("not run: an adapter in software has the processor's memory");
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
/// lower than 3.5 mm above the ground (`docs/computation/batch.md`); here the contact of a tip is lost for a substep when fruit come off.
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
        data = state(&mut batch, &worlds[0], 0);
        lowest = tips(&worlds[0], &data).iter().fold(lowest, |low, tip| low.min(tip.z));
    }
    let fastest = data.v.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    println!("lowest tip {lowest} m, fastest joint at the end {fastest} rad/s");
    assert!(batch.statistics().unwrap()[0].snapped > 0);
    assert!(lowest > 0.0 && lowest < 0.02, "{lowest}");
    assert!(fastest < 0.05, "{fastest}");
}

/// The energy of the device's own state, computed in f64. Potential energies of some hundred joules stand in f32 beside motions of a few.
#[test]
fn energy_is_that_of_f64() {
    let Some(gpu) = device() else { return };
    let (worlds, trial) = Trial::harsh(grown(3));
    let mut batch = GpuBatch::new(&gpu, &worlds).unwrap();
    trial.apply_to_batch(&mut batch);
    for _ in 0..12 {
        let statistics = batch.statistics().unwrap();
        for (index, world) in worlds.iter().enumerate() {
            let (plant, data) = (world.plant(), state(&mut batch, world, index));
            let truth = energy(&plant.model, &data, &plant.settings.gravity);
            let scale = truth.gravitational.abs() + truth.anchor_bias.abs();
            let found = f64::from(statistics[index].energy);
            assert!((found - truth.total()).abs() < 2e-6 * scale, "world {index}: {found} J, {truth:?}");
        }
        batch.advance(1);
    }
    // Broken limbs and loose fruit are counted as well.
    let lost = |statistics: &Statistics| statistics.snapped + statistics.detached;
    assert!(batch.statistics().unwrap().iter().any(|world| lost(world) > 0));
}

/// Forces that act in given frames do the same as forces that are set and taken away by hand.
#[test]
fn scripted_forces_act_in_their_frames() {
    let Some(gpu) = device() else { return };
    let mut worlds = grown(2);
    let options = Options { pushes_each: 2, ..Options::default() };
    let mut batch = GpuBatch::with_options(&gpu, &worlds, options).unwrap();
    let (force, torque, none) = (Vec3::new(3.0, -2.0, 1.0), Vec3::new(0.1, 0.0, 0.2), Vec3::zeros());
    let segment = worlds[1].plant().tree.len() / 2;
    assert!(batch.script(1, segment, force, torque, 3..=5));
    assert!(batch.script(1, segment, force, none, 5..=6));
    assert!(!batch.script(1, segment, force, none, 9..=9), "no room");
    let body = worlds[1].plant().tree.bodies[segment].index();
    for frame in 1..=10_u32 {
        let first = f64::from(u8::from((3..=5).contains(&frame)));
        let second = f64::from(u8::from((5..=6).contains(&frame)));
        worlds[1].data_mut().body_force_world[body] = force * (first + second);
        worlds[1].data_mut().body_torque_world[body] = torque * first;
        worlds.iter_mut().for_each(|world| assert_eq!(world.step(), []));
        batch.advance(1);
        let errors = Errors::of(&worlds[1], &state(&mut batch, &worlds[1], 1));
        assert!(is_small(errors), "frame {frame}: {errors:?}");
    }
    assert!(batch.script(1, segment, force, none, 12..=12), "a force whose frames are over has made room");
}

/// Conjugate gradients find the solution that elimination finds, also with broken limbs and loose fruit. They differ by what is left of the residual.
#[test]
fn conjugate_gradients_agree_with_elimination() {
    let Some(gpu) = device() else { return };
    for (frames, (worlds, trial), most) in
        [(30, Trial::gentle(grown(3)), 1e-5), (8, Trial::harsh(grown(3)), 1e-4)]
    {
        let [mut exact, mut iterated] = [Solver::Aba, Solver::ConjugateGradients].map(|solver| {
            let options = Options { pushes_each: 8, solver, ..Options::default() };
            let mut batch = GpuBatch::with_options(&gpu, &worlds, options).unwrap();
            trial.apply_to_batch(&mut batch);
            batch.advance(frames);
            batch
        });
        for (index, world) in worlds.iter().enumerate() {
            let [a, b] = [&mut exact, &mut iterated].map(|batch| state(batch, world, index));
            let size = a.q.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let error = a.q.iter().zip(&b.q).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / size;
            println!("world {index}, {frames} frames: {error:.1e}");
            assert!(error < most);
        }
        assert_eq!(exact.events().unwrap(), iterated.events().unwrap());
    }
}

/// In a tree at rest the right-hand side is nothing but rounding. The iterations end there, and the tree stays at rest.
#[test]
fn conjugate_gradients_end_in_rounding() {
    let Some(gpu) = device() else { return };
    let worlds = grown(3);
    let options = Options { solver: Solver::ConjugateGradients, ..Options::default() };
    let mut batch = GpuBatch::with_options(&gpu, &worlds, options).unwrap();
    batch.advance(60);
    for (index, world) in worlds.iter().enumerate() {
        let errors = Errors::of(world, &state(&mut batch, world, index));
        assert!(is_small(errors), "world {index}: {errors:?}");
    }
}

/// A batch that is too large for a buffer of the device is refused with the number of worlds that would fit, and that number fits.
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

/// A lost device is an error of the next read, and the state that was to be filled stays unchanged.
#[test]
fn a_lost_device_is_an_error() {
    if device().is_none() {
        return;
    }
    let gpu = Gpu::open(Choice::Any).unwrap();
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
    assert!(gpu.is_lost());
}
