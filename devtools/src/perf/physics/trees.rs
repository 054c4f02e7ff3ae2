//! Rows of trees that nothing touches: one in f64, and batches in lanes.

use orchard_batch::{Batch, Isa, TreeWorld};
use orchard_scaling::resident_bytes;
use rayon::prelude::*;

use super::forest::{Planting, mjcf_of};
use super::peer::Course;
use super::{Bench, FRAMES, Plan, THREADS, WORLDS, limit};
use crate::perf::timing::{Side, cpu_time};
use orchard_program::rows::Row;

/// Targets: multiples of MuJoCo's rate, and the share of the batch's rate that worlds with different topologies reach.
const ONE_TREE_RATIO: f64 = 6.0;
const BATCH_RATIO: f64 = 45.0;
const TOPOLOGIES_SHARE: f64 = 0.5;

const ONE_TREE_LIMIT: &str = "Limited by gathering two links into each register and scattering them back, by copies and spills of two-operand \
                              instructions, and by the long dependency chains of sines and quotients";
const BATCH_LIMIT: &str = "Limited by loads and stores between registers and cache, about one for every two operations, by dependency chains \
                           from link to link, and by sums and products that cannot be fused into one instruction";

/// Rows of one tree and of batches. The forest is sorted from shallow to deep trees.
pub fn rows(bench: &Bench, forest: &[Planting]) -> anyhow::Result<Vec<Row>> {
    let typical = &forest[forest.len() / 2];
    let mut rows = vec![
        one_tree(bench, "physics.one_tree", typical)?.at_least_times(ONE_TREE_RATIO),
        one_tree(bench, "physics.one_tree_shallow", &forest[0])?,
    ];
    rows.extend(batches(bench, typical, forest)?);
    Ok(rows)
}

fn one_tree(bench: &Bench, name: &str, planting: &Planting) -> anyhow::Result<Row> {
    let world = planting.kicked(0)?;
    bench.load(name, || Ok(vec![mjcf_of(&world)?]))?;
    let Plan { repeats, peer_repeats, .. } = bench.plan;
    let ours: Side<'_> = Box::new(|| Ok(rate(&world, bench.substeps, repeats)));
    let course = Course { lead: 0, steps: FRAMES * bench.substeps, repeats: peer_repeats };
    let (ours, theirs) = bench.beside_peer(name, vec![ours], course, 1, 1)?;
    let mut row = bench.row(name, &ours[0], theirs.as_ref());
    let mut end = world.clone();
    let events: usize = (0..FRAMES).map(|_| end.step().len()).sum();
    let fastest = end.data().v.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    anyhow::ensure!(fastest > 0.0, "the tree is at rest");
    let plant = world.plant();
    row.note = Some(format!(
        "{} links, {:.1} deep on average, {} fruit, {} degrees of freedom; {events} breaks and detachments in a course, at whose end the \
         fastest joint turns at {fastest:.2} rad/s",
        plant.tree.len(),
        planting.mean_depth(),
        plant.fruit.len(),
        plant.model.nv() + 3 * plant.fruit.len(),
    ));
    row.limit = Some(bench.peaks.of_f64(ours[0].median(), limit::operations(&world), ONE_TREE_LIMIT));
    Ok(row)
}

/// Substeps per second of one tree over courses from its start.
pub fn rate(world: &TreeWorld, substeps: u32, repeats: u32) -> f64 {
    let mut spent = 0.0;
    for _ in 0..repeats {
        let mut world = world.clone();
        let start = cpu_time();
        for _ in 0..FRAMES {
            std::hint::black_box(world.step());
        }
        spent += (cpu_time() - start).as_secs_f64();
    }
    f64::from(FRAMES * substeps * repeats) / spent
}

fn batches(bench: &Bench, typical: &Planting, forest: &[Planting]) -> anyhow::Result<Vec<Row>> {
    let names = ["physics.batch_512", "physics.batch_512_topologies"];
    bench.say(&format!("{}: settling", names[0]));
    let siblings: Vec<Planting> = (0..WORLDS as u32).map(|index| typical.sibling(index)).collect();
    let before = resident_bytes();
    let siblings = settle(&siblings)?;
    let of_f64 = resident_bytes().zip(before).map(|(after, before)| (after - before) / WORLDS as f64);
    let grown = settle(forest)?;
    let peer_worlds = bench.plan.peer_worlds;
    bench.load(names[0], || siblings[..peer_worlds].par_iter().map(mjcf_of).collect())?;

    let pool = rayon::ThreadPoolBuilder::new().num_threads(THREADS).build()?;
    let side = |start: Batch| -> Side<'_> {
        let (pool, repeats) = (&pool, bench.plan.batch_repeats);
        Box::new(move || {
            let mut spent = 0.0;
            for _ in 0..repeats {
                let mut batch = start.clone();
                let start = cpu_time();
                pool.install(|| batch.step(FRAMES));
                spent += (cpu_time() - start).as_secs_f64();
            }
            let substeps = f64::from(FRAMES * bench.substeps * repeats) * WORLDS as f64;
            Ok(substeps * THREADS as f64 / spent)
        })
    };
    let batches = [Batch::new(&siblings)?, Batch::new(&grown)?];
    let memory = batches.each_ref().map(|batch| batch.bytes() as f64 / WORLDS as f64);
    let sides = batches.map(side).into();
    let course = Course { lead: 0, steps: FRAMES * bench.substeps, repeats: 1 };
    let (ours, theirs) = bench.beside_peer(names[0], sides, course, peer_worlds, THREADS)?;

    let row = |which: usize, worlds: &[TreeWorld]| {
        let rate = ours[which].median();
        let mut row = bench.row(names[which], &ours[which], theirs.as_ref());
        let mean = |of: fn(&TreeWorld) -> f64| worlds.iter().map(of).sum::<f64>() / WORLDS as f64;
        row.note = Some(format!(
            "{:.1} links and {:.1} fruit per tree on average, {THREADS} threads, {} lanes of f32 ({:?})",
            mean(|world| world.plant().tree.len() as f64),
            mean(|world| world.plant().fruit.len() as f64),
            Isa::best().lanes(),
            Isa::best(),
        ));
        row.limit = Some(bench.peaks.of_lanes(rate / THREADS as f64, mean(limit::operations), BATCH_LIMIT));
        row
    };
    let shares = ours[1].over(&ours[0]);
    let share = Row::measured("physics.batch_512_topologies.share", shares.median(), "1");
    let mut rows = vec![
        row(0, &siblings).at_least_times(BATCH_RATIO),
        row(1, &grown),
        Row { spread: Some(shares.spread()), ..share }.at_least(TOPOLOGIES_SHARE),
    ];
    for (name, memory) in names.iter().zip(memory) {
        rows.push(Row::measured(&format!("{name}.memory"), memory, "bytes/world"));
    }
    if let Some(of_f64) = of_f64 {
        rows.push(Row::measured("physics.one_tree.memory", of_f64, "bytes/world"));
    }
    Ok(rows)
}

/// The trees in worlds, kicked, each in its own way.
fn settle(plantings: &[Planting]) -> anyhow::Result<Vec<TreeWorld>> {
    plantings.par_iter().enumerate().map(|(index, planting)| planting.kicked(index as u32)).collect()
}
