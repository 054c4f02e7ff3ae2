//! The twin against the f64 worlds that its memory was made of.

use orchard_batch::TreeEvent;

use crate::memory::Memory;
use crate::trials::{Trial, errors, grown, state, tips};

/// The bounds: 5e-5 of the joint state, 0.01 mm at the tips.
#[test]
fn pull_and_release_agrees_with_f64() {
    let (mut worlds, pull) = Trial::gentle(grown(4));
    let mut memory = Memory::new(&worlds, 8).unwrap();
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
    let mut memory = Memory::new(&worlds, 4).unwrap();
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
