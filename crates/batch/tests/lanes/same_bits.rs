//! A world's result does not depend on its batch neighbours.

use crate::trees::{bits, drop_fruit, grown, kick, measured, siblings, state, stemmed, tip_over, tips};
use orchard_batch::{Batch, Isa, TreeWorld};
use sha2::{Digest, Sha256};

/// A way to make worlds do all that a step can do.
struct Course {
    worlds: Vec<TreeWorld>,
    /// Segment to break at the beginning, of each world.
    broken_first: Option<usize>,
    /// Frames before and after a limb breaks.
    frames: [u32; 2],
}

impl Course {
    /// Kicked, with a limb broken after a while.
    fn kicked() -> Self {
        let mut worlds = orchard();
        kick(&mut worlds, 3.0);
        Self { worlds, broken_first: None, frames: [20, 20] }
    }

    /// Toppled, with fruit that has fallen and rolls.
    fn fallen() -> Self {
        let mut worlds = orchard();
        kick(&mut worlds, 0.5);
        let mut broken_first = None;
        for (world, index) in worlds.iter_mut().zip(0..) {
            let point = drop_fruit(world, 0.05 * f64::from(index));
            world.data_mut().point_v_world[point].x = 0.5;
            broken_first = Some(tip_over(world, 4.0 - 0.1 * f64::from(index)));
        }
        Self { worlds, broken_first, frames: [130, 0] }
    }

    /// Kicked, of wood as measured.
    fn measured() -> Self {
        let mut worlds = measured(9);
        kick(&mut worlds, 3.0);
        Self { worlds, broken_first: None, frames: [20, 20] }
    }

    /// Kicked, with fruit on stems that bend.
    fn on_stems() -> Self {
        let mut worlds = stemmed(9);
        kick(&mut worlds, 3.0);
        Self { worlds, broken_first: None, frames: [20, 20] }
    }

    fn all() -> [Self; 4] {
        [Self::kicked(), Self::fallen(), Self::measured(), Self::on_stems()]
    }

    fn run(&self, worlds: &[TreeWorld], isa: Isa) -> (Batch, Vec<Vec<u64>>) {
        let mut batch = Batch::with_isa(worlds, isa).unwrap();
        let all = 0..worlds.len();
        self.broken_first
            .iter()
            .for_each(|segment| all.clone().for_each(|index| batch.break_branch(index, *segment)));
        batch.step(self.frames[0]);
        if self.frames[1] > 0 {
            all.clone().for_each(|index| batch.break_branch(index, worlds[index].plant().tree.len() / 2));
            batch.step(self.frames[1]);
        }
        let states = all.map(|index| bits(&state(&mut batch, &worlds[index], index))).collect();
        (batch, states)
    }
}

/// Tiles of one topology, and tiles in which a row has as many parents as lanes.
fn orchard() -> Vec<TreeWorld> {
    let mut worlds = siblings(9);
    worlds.extend(grown(12));
    worlds
}

#[test]
fn fallen_worlds_lie_on_the_ground() {
    let course = Course::fallen();
    let (mut batch, _) = course.run(&course.worlds, Isa::best());
    let mut fallen = 0;
    for (index, world) in course.worlds.iter().enumerate() {
        let data = state(&mut batch, world, index);
        let lowest = tips(world, &data).iter().fold(f64::INFINITY, |m, tip| m.min(tip.z));
        fallen += usize::from(lowest < 0.01);
        let fruit = &world.plant().fruit;
        let gap = data.point_p_world[fruit.points[0].index()].z - fruit.fruit[0].radius;
        assert!(gap < 1e-3, "world {index}: {gap}");
    }
    // Some hinges seize before.
    assert!(fallen > course.worlds.len() * 3 / 4, "{fallen}");
}

#[test]
fn alone_or_beside_any_neighbours() {
    for course in Course::all() {
        let worlds = &course.worlds;
        for isa in Isa::available() {
            let (_, together) = course.run(worlds, isa);
            let (_, other_neighbours) = course.run(&worlds[3..], isa);
            assert_eq!(other_neighbours, together[3..], "{isa:?}");
            for (index, expected) in together.iter().enumerate() {
                let (_, alone) = course.run(&worlds[index..=index], isa);
                assert_eq!(&alone[0], expected, "{isa:?}, world {index}");
            }
        }
    }
}

/// Chunks are packed for themselves: worlds keep their numbers, and their bits.
#[test]
fn packed_at_once_or_in_chunks() {
    let Course { worlds, frames, .. } = Course::kicked();
    let batches = [
        Batch::new(&worlds).unwrap(),
        Batch::of_chunks(worlds.chunks(8), Isa::best()).unwrap(),
        Batch::of_chunks(worlds.iter().map(std::slice::from_ref), Isa::best()).unwrap(),
    ];
    let [at_once, in_chunks, one_by_one] = batches.map(|mut batch| {
        (0..worlds.len()).for_each(|index| batch.break_branch(index, worlds[index].plant().tree.len() / 2));
        let events = batch.step(frames[0]);
        assert!(!events.is_empty());
        let states = (0..worlds.len()).map(|index| bits(&state(&mut batch, &worlds[index], index)));
        (events, states.collect::<Vec<_>>())
    });
    assert_eq!(at_once, in_chunks);
    assert_eq!(at_once, one_by_one);
}

/// SHA-256 over what the courses of the paper's trees end in, for sets that round a product and sum once and for those that do so twice. A change of
/// physics, growth or config changes them, as it does the hashes of the f64 states; after an intended change, one
/// takes the new ones from this test's message.
const FUSED: &str = "3bed69950957ef5c0bda8a63c5da59e7580ae0b660f777c23a9ac343a59debbf";
const UNFUSED: &str = "78495cea5ec348e4e087a6c51f1e17216d58e4f8bb19d68b57da23b4085cdb9f";

/// Instruction sets differ in the rounding of a product and sum alone, on every processor.
#[test]
fn sets_that_round_alike_agree_on_every_processor() {
    let courses = [Course::kicked(), Course::fallen()];
    for isa in Isa::available() {
        let mut hash = Sha256::new();
        for course in &courses {
            let numbers = course.run(&course.worlds, isa).1.concat();
            numbers.iter().for_each(|number| hash.update(number.to_le_bytes()));
        }
        let hash: String = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        println!("{isa:?}, fused: {}: {hash}", isa.is_fused());
        assert_eq!(hash, if isa.is_fused() { FUSED } else { UNFUSED }, "{isa:?}");
    }
}

#[test]
fn any_number_of_threads() {
    for course in Course::all() {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| course.run(&course.worlds, Isa::best()).1)
        };
        let one = on(1);
        assert_eq!(on(2), one);
        assert_eq!(on(5), one);
    }
}

#[test]
fn a_clone_goes_on_alike_and_frames_may_be_taken_at_once() {
    for course in Course::all() {
        let worlds = &course.worlds;
        let (mut batch, _) = course.run(worlds, Isa::best());
        let mut copy = batch.clone();
        batch.step(10);
        for _ in 0..10 {
            copy.step(1);
        }
        for (index, world) in worlds.iter().enumerate() {
            let [a, b] = [&mut copy, &mut batch].map(|batch| bits(&state(batch, world, index)));
            assert_eq!(a, b);
        }
    }
}
