//! Suite `physics`: substeps of tree worlds a second. Every timed world is kicked, and may break and drop fruit.
//!
//! MuJoCo's figures stand beside these once it runs on the exported trees in the same suite; until then the
//! peer columns are null.

use std::sync::Arc;

use anyhow::Context;
use orchard_batch::{Batch, Isa, TreeWorld};
use orchard_fruit::place;
use orchard_spec::{Purpose, Spec, Stream};
use orchard_treegen::grow;

use super::timing::median_cpu_seconds;
use crate::rows::Row;

const SEED: u64 = 1;
/// Links of the tree that the figures are about, and how far a tree may be from it, either way.
const LINKS: usize = 151;
const LINKS_TOLERANCE: usize = 15;
/// Worlds of a batch.
const WORLDS: usize = 512;
/// Threads that share a batch.
const THREADS: usize = 2;
/// World indices among which trees of the right size are looked for.
const SEARCHED: u32 = 20_000;
/// Largest rate that a kick gives a joint [rad/s].
const KICK: f64 = 1.0;
/// Frames of a round: long enough to be timed, short enough that the kick is still felt.
const FRAMES: u32 = 60;

pub fn measure() -> anyhow::Result<Vec<Row>> {
    let spec = Arc::new(Spec::paper());
    let substeps = f64::from(FRAMES * spec.sim.substeps.get());
    let like = |world: &u32| {
        grow(&spec, SEED, *world).is_ok_and(|tree| tree.segments.len().abs_diff(LINKS) <= LINKS_TOLERANCE)
    };
    let candidates: Vec<u32> = (0..SEARCHED).filter(like).take(WORLDS).collect();
    let first = *candidates.first().context("no tree of the right size grows")?;

    let mut one = vec![TreeWorld::grow(spec.clone(), SEED, first)?];
    kick(&mut one);
    eprintln!("one tree: {} links, {} fruit", one[0].plant().tree.len(), one[0].plant().fruit.len());
    let seconds = median_cpu_seconds(
        || one[0].clone(),
        |mut world| {
            for _ in 0..FRAMES {
                std::hint::black_box(world.step());
            }
        },
    );
    let mut rows = vec![Row::measured("physics.one_tree", substeps / seconds, "substeps/s")];

    let skeleton = grow(&spec, SEED, first)?;
    let fruit = place(&spec.fruit, &skeleton, SEED, first);
    let siblings = (0..WORLDS as u32).map(|world| {
        let (mut own, mut stream) = (skeleton.clone(), Stream::new(SEED, world, Purpose::Test));
        for segment in &mut own.segments {
            segment.length *= stream.uniform(0.9, 1.1);
            segment.radius *= stream.uniform(0.95, 1.05);
        }
        TreeWorld::new(spec.clone(), &own, fruit.clone())
    });
    let siblings = siblings.collect::<Result<Vec<_>, _>>()?;
    rows.extend(batch_rows("physics.batch_512", siblings, substeps)?);
    if candidates.len() == WORLDS {
        let grown = candidates.iter().map(|&world| TreeWorld::grow(spec.clone(), SEED, world));
        let grown = grown.collect::<Result<Vec<_>, _>>()?;
        rows.extend(batch_rows("physics.batch_512_topologies", grown, substeps)?);
    } else {
        eprintln!("only {} trees of the right size: no batch of different topologies", candidates.len());
    }
    Ok(rows)
}

/// Gives every joint a random rate.
fn kick(worlds: &mut [TreeWorld]) {
    for (world, index) in worlds.iter_mut().zip(0..) {
        let mut stream = Stream::new(SEED + 1, index, Purpose::Test);
        for v in &mut world.data_mut().v {
            *v = stream.uniform(-KICK, KICK);
        }
    }
}

/// Rate of a batch if its threads have a core each, by processor time, and its memory a world.
fn batch_rows(name: &str, mut worlds: Vec<TreeWorld>, substeps: f64) -> anyhow::Result<Vec<Row>> {
    kick(&mut worlds);
    let batch = Batch::new(&worlds)?;
    let links: usize = worlds.iter().map(|world| world.plant().tree.len()).sum();
    let fruit: usize = worlds.iter().map(|world| world.plant().fruit.len()).sum();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(THREADS).build()?;
    let mut events = 0;
    let seconds =
        median_cpu_seconds(|| batch.clone(), |mut batch| events = pool.install(|| batch.step(FRAMES)).len());
    eprintln!(
        "{name}: {:?}, {:.0} links and {:.0} fruit a tree, {events} breaks and detachments",
        Isa::best(),
        links as f64 / WORLDS as f64,
        fruit as f64 / WORLDS as f64
    );
    let rate = substeps * WORLDS as f64 * THREADS as f64 / seconds;
    let memory = batch.bytes() as f64 / WORLDS as f64;
    Ok(vec![
        Row::measured(name, rate, "substeps/s"),
        Row::measured(&format!("{name}.memory"), memory, "bytes/world"),
    ])
}
