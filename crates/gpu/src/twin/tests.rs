//! The twin against the f64 worlds that its memory was made of.

use orchard_batch::TreeEvent;
use orchard_geometry::Vec3;
use orchard_multibody::{energy, forward_kinematics};

use crate::Solver;
use crate::layout::{krylov, world};
use crate::memory::Memory;
use crate::schedule::PARTS;
use crate::trials::{Trial, errors, grown, state, tips};

/// The bounds: 5e-5 of the joint state, 0.01 mm at the tips.
#[test]
fn pull_and_release_agrees_with_f64() {
    let (mut worlds, pull) = Trial::gentle(grown(4));
    let mut memory = Memory::new(&worlds, 8, Solver::Aba).unwrap();
    for trial in [pull.clone(), pull.released()] {
        trial.apply_to_twin(&mut memory);
        trial.apply_to_worlds(&mut worlds);
        for _ in 0..30 {
            memory.frame();
            worlds.iter_mut().for_each(|world| assert_eq!(world.step(), []));
        }
        for (index, world) in worlds.iter().enumerate() {
            let (q, v, tip) = errors(world, state(&memory, &worlds, index));
            println!("world {index}: angle {q:.1e}, rate {v:.1e} rad/s, tip {tip:.1e} m");
            assert!(q < 5e-5 && v < 1e-4 && tip < 1e-5);
        }
    }
}

/// Tiles that share a block stay out of each other's lanes, and blocks out of each other's rows.
#[test]
fn worlds_are_the_same_in_tiles_of_their_own() {
    for solver in [Solver::Aba, Solver::ConjugateGradients] {
        // As many as fill more than one block if each has a tile.
        let (worlds, trial) = Trial::harsh(grown(18));
        let [mut together, mut spread] =
            [1, 18].map(|tiles| Memory::spread_over(tiles, &worlds, 4, solver).unwrap());
        assert_eq!((together.tile_count(), spread.tile_count()), (1, 18));
        assert_eq!(spread.blocks_of(&(0..18).collect::<Vec<_>>()).len(), 2);
        for memory in [&mut together, &mut spread] {
            trial.apply_to_twin(memory);
            (0..3).for_each(|_| memory.frame());
        }
        for index in 0..worlds.len() {
            let [a, b] = [&together, &spread].map(|memory| state(memory, &worlds, index));
            assert_eq!((a.q, a.v, a.point_p_world), (b.q, b.v, b.point_p_world), "world {index}");
            assert_eq!(happened(&together, index), happened(&spread, index));
        }
    }
}

/// What happened to a world, by frame: joints that broke and fruit that came off.
fn happened(memory: &Memory, index: usize) -> Vec<(u32, TreeEvent)> {
    let (broke, off) = memory.lost(index);
    let snapped =
        broke.into_iter().enumerate().map(|(segment, frame)| (frame, TreeEvent::Snapped { segment }));
    let detached = off.into_iter().enumerate().map(|(fruit, frame)| (frame, TreeEvent::Detached { fruit }));
    let mut all: Vec<_> = snapped.chain(detached).filter(|(frame, _)| *frame > 0).collect();
    all.sort();
    all
}

/// The same things happen to the same worlds in the same frames. What falls falls alike: an error of the swing of a broken limb grows with it, and
/// before the ground is near it stays below a millimetre.
#[test]
fn what_comes_off_comes_off_in_the_same_frame() {
    const NEAR: f64 = 0.2;
    let (mut worlds, trial) = Trial::harsh(grown(6));
    let mut memory = Memory::new(&worlds, 4, Solver::Aba).unwrap();
    trial.apply_to_twin(&mut memory);
    trial.apply_to_worlds(&mut worlds);
    let mut expected = vec![Vec::new(); worlds.len()];
    let mut has_landed = vec![false; worlds.len()];
    for frame in 1..=20 {
        memory.frame();
        for (index, world) in worlds.iter_mut().enumerate() {
            expected[index].extend(world.step().into_iter().map(|event| (frame, event)));
            let low = tips(world, world.data()).into_iter().enumerate();
            has_landed[index] |=
                low.into_iter().any(|(segment, p)| world.rupture().is_debris(segment) && p.z < NEAR);
        }
        for (index, world) in worlds.iter().enumerate().filter(|(index, _)| !has_landed[*index]) {
            let (_, _, tip) = errors(world, state(&memory, &worlds, index));
            assert!(tip < 1e-3, "world {index}, frame {frame}: {tip}");
        }
    }
    for (index, mut expected) in expected.into_iter().enumerate() {
        expected.sort();
        assert_eq!(happened(&memory, index), expected);
        assert!(expected.iter().any(|(_, event)| matches!(event, TreeEvent::Snapped { .. })));
    }
}

/// A reset world is whole, at rest and in the equilibrium that f64 finds, and goes on as a new one does; the others do not notice.
#[test]
fn a_reset_world_is_as_new() {
    let (worlds, trial) = Trial::harsh(grown(6));
    let mut memory = Memory::new(&worlds, 4, Solver::Aba).unwrap();
    trial.apply_to_twin(&mut memory);
    (0..20).for_each(|_| memory.frame());
    trial.released().apply_to_twin(&mut memory);
    let others = [1, 3].map(|index| state(&memory, &worlds, index));
    let reset = [0, 2, 4, 5];
    assert!(reset.iter().any(|&index| !happened(&memory, index).is_empty()));
    memory.reset(&reset);
    for (index, before) in [1, 3].into_iter().zip(others) {
        let now = state(&memory, &worlds, index);
        assert_eq!((now.q, now.v), (before.q, before.v));
    }
    let fresh = grown(6);
    for frames in [0, 60] {
        (0..frames).for_each(|_| memory.frame());
        for index in reset {
            let (q, v, tip) = errors(&fresh[index], state(&memory, &worlds, index));
            println!("world {index}, {frames} frames: angle {q:.1e}, rate {v:.1e} rad/s, tip {tip:.1e} m");
            assert!(q < 5e-5 && v < 1e-4 && tip < 1e-5);
            assert_eq!(happened(&memory, index), []);
        }
    }
}

/// The energy of the twin's own state, in f64. Potential energies of some hundred joules stand in f32 for motions of a few.
#[test]
fn energy_is_that_of_f64() {
    let (worlds, trial) = Trial::harsh(grown(3));
    let mut memory = Memory::new(&worlds, 4, Solver::Aba).unwrap();
    trial.apply_to_twin(&mut memory);
    for _ in 0..12 {
        memory.measure();
        for (index, world) in worlds.iter().enumerate() {
            let (plant, mut data) = (world.plant(), state(&memory, &worlds, index));
            forward_kinematics(&plant.model, &mut data);
            let truth = energy(&plant.model, &data, &plant.settings.gravity);
            let scale = truth.gravitational.abs() + truth.anchor_bias.abs();
            let found = f64::from(f32::from_bits(memory.world_number(index, world::ENERGY)));
            assert!((found - truth.total()).abs() < 2e-6 * scale, "world {index}: {found} J, {truth:?}");
        }
        memory.frame();
    }
    assert!(
        (0..3).any(|index| !happened(&memory, index).is_empty()),
        "limbs and fruit that are off count as well"
    );
}

/// Forces that act in some frames do what the same forces do that are set and taken away by hand.
#[test]
fn scripted_forces_act_in_their_frames() {
    let mut worlds = grown(2);
    let mut memory = Memory::new(&worlds, 2, Solver::Aba).unwrap();
    let (force, torque, none) = (Vec3::new(3.0, -2.0, 1.0), Vec3::new(0.1, 0.0, 0.2), Vec3::zeros());
    let segment = worlds[1].plant().tree.len() / 2;
    assert!(memory.script(1, segment, force, torque, 3..=5));
    assert!(memory.script(1, segment, force, none, 5..=6));
    assert!(!memory.script(1, segment, force, none, 9..=9), "no room");
    let body = worlds[1].plant().tree.bodies[segment].index();
    for frame in 1..=10_u32 {
        let first = f64::from(u8::from((3..=5).contains(&frame)));
        let second = f64::from(u8::from((5..=6).contains(&frame)));
        worlds[1].data_mut().body_force_world[body] = force * (first + second);
        worlds[1].data_mut().body_torque_world[body] = torque * first;
        worlds.iter_mut().for_each(|world| assert_eq!(world.step(), []));
        memory.frame();
        let (q, v, tip) = errors(&worlds[1], state(&memory, &worlds, 1));
        assert!(q < 5e-5 && v < 1e-4 && tip < 1e-5, "frame {frame}: {q:.1e}, {v:.1e} rad/s, {tip:.1e} m");
    }
    assert!(memory.script(1, segment, force, none, 12..=12), "what is over has made room");
}

/// Asked for more than f32 has, conjugate gradients come to where products are nothing but rounding, and end there.
#[test]
fn conjugate_gradients_end_in_rounding() {
    let (worlds, _) = Trial::gentle(grown(3));
    let mut memory = Memory::new(&worlds, 4, Solver::ConjugateGradients).unwrap();
    for frame in 0..8 {
        memory.frame();
        for (index, world) in worlds.iter().enumerate() {
            let rows: Vec<usize> =
                (0..world.plant().tree.len()).map(|segment| memory.row_of(index, segment)).collect();
            let mut own = memory.lane_of(index);
            (0..PARTS).rev().for_each(|part| own.inward(part));
            own.solve_to(0.0);
            let largest_change = |row: usize| {
                let [x_1, x_2, ..] = own.krylov(own.krylov_of(row), krylov::X);
                x_1.hypot(x_2)
            };
            // Of rates of half a radian a second.
            let is_small = |row: &usize| largest_change(*row) < 10.0;
            assert!(rows.iter().all(is_small), "frame {frame}, world {index}");
            assert!(rows.iter().any(|row| largest_change(*row) > 0.0));
        }
    }
}

/// Conjugate gradients go where elimination goes, also with broken limbs and loose fruit: what is left of the residual is what they may differ by.
#[test]
fn conjugate_gradients_agree_with_elimination() {
    for (frames, (worlds, trial), most) in
        [(30, Trial::gentle(grown(3)), 1e-5), (8, Trial::harsh(grown(3)), 1e-4)]
    {
        let [mut exact, mut iterated] = [Solver::Aba, Solver::ConjugateGradients].map(|solver| {
            let mut memory = Memory::new(&worlds, 8, solver).unwrap();
            trial.apply_to_twin(&mut memory);
            (0..frames).for_each(|_| memory.frame());
            memory
        });
        for index in 0..worlds.len() {
            let [a, b] = [&mut exact, &mut iterated].map(|memory| state(memory, &worlds, index));
            let size = a.q.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let error = a.q.iter().zip(&b.q).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / size;
            println!("world {index}, {frames} frames: {error:.1e}");
            assert!(error < most);
            assert_eq!(happened(&exact, index), happened(&iterated, index));
        }
    }
}
