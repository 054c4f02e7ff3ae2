//! A world's result depends on nothing but itself.

use crate::common::{bits, grown, kick, siblings, state};
use orchard_batch::{Batch, Isa, TreeWorld};

/// Kicked, with a limb broken after a while: every part of a step takes part.
fn run(worlds: &[TreeWorld], isa: Isa) -> (Batch, Vec<Vec<u64>>) {
    let mut batch = Batch::with_isa(worlds, isa).unwrap();
    batch.step(20);
    for (index, world) in worlds.iter().enumerate() {
        batch.break_branch(index, world.plant().tree.len() / 2);
    }
    batch.step(20);
    let states = (0..worlds.len()).map(|index| bits(&state(&batch, worlds, index))).collect();
    (batch, states)
}

fn orchard() -> Vec<TreeWorld> {
    let mut worlds = siblings(9);
    worlds.extend(grown(4));
    kick(&mut worlds, 3.0);
    worlds
}

#[test]
fn alone_or_in_any_company() {
    let worlds = orchard();
    for isa in Isa::available() {
        let (_, together) = run(&worlds, isa);
        for (index, expected) in together.iter().enumerate() {
            let (_, alone) = run(&worlds[index..=index], isa);
            assert_eq!(&alone[0], expected, "{isa:?}, world {index}");
        }
    }
}

/// How a product and sum are rounded is all that differs between instruction sets.
#[test]
fn sets_that_round_alike_agree() {
    let worlds = orchard();
    for is_fused in [true, false] {
        let mut results = Isa::available()
            .into_iter()
            .filter(|isa| isa.is_fused() == is_fused)
            .map(|isa| run(&worlds, isa).1);
        if let Some(first) = results.next() {
            assert!(results.all(|other| other == first), "fused: {is_fused}");
        }
    }
}

#[test]
fn any_number_of_threads() {
    let worlds = orchard();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&worlds, Isa::best()).1)
    };
    let one = on(1);
    assert_eq!(on(2), one);
    assert_eq!(on(5), one);
}

#[test]
fn a_clone_goes_on_alike_and_frames_may_be_taken_at_once() {
    let worlds = orchard();
    let (mut batch, _) = run(&worlds, Isa::best());
    let mut copy = batch.clone();
    batch.step(10);
    for _ in 0..10 {
        copy.step(1);
    }
    for index in 0..worlds.len() {
        assert_eq!(bits(&state(&copy, &worlds, index)), bits(&state(&batch, &worlds, index)));
    }
}
