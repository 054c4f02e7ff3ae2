//! Suite `gpu`: batches of trees, of robots, and of worlds with both, on the graphics device. Every world is kicked, with ruptures, detachments, drag and tests on.

mod counters;
mod robots;
mod stems;
mod warp;
pub mod worlds;

use std::sync::Arc;
use std::time::Instant;

use anyhow::Context;
use orchard_batch::TreeWorld;
use orchard_gpu::{BaseTree, Choice, Gpu, GpuBatch};
use orchard_scaling::ScalingRules;
use orchard_scaling::wake;
use orchard_spec::randomisation::Mode;
use orchard_spec::{Preset, Spec};
use orchard_tasks::protocol::Protocol;
use rayon::prelude::*;

use super::physics::forest::{Planting, kick, mjcf_of, nearest, spec_with_fruit};
use super::physics::{FRUIT, LINKS, SEARCHED, WORLDS};
use super::timing::Rounds;
use super::{say, spinner};
use counters::Counters;
use orchard_program::rows::{Effort, Measured, Row};
use warp::Peer;

/// Frames of a round, and rounds.
const FRAMES: u32 = 60;
const ROUNDS: usize = 5;
/// Frames of a batch before its first round.
const WARM_UP: u32 = 10;
/// Worlds of the rows with their targets on one H200 \[substeps/s\].
const TARGETS: [(usize, f64); 3] = [(512, 6e6), (4096, 28e6), (16384, 45e6)];
/// Worlds of the rows about memory, building and topologies, and their targets: bytes, seconds, share of the rate of one topology.
const MANY: usize = 4096;
const MEMORY: f64 = 150e6;
const BUILD: f64 = 0.5;
const TOPOLOGIES: f64 = 0.5;
/// Worlds on a software adapter.
const SOFTWARE_WORLDS: usize = 32;
/// Seed of the draws of the worlds that the device builds.
const SEED: u64 = 1;

const NOTE: &str =
    "151 links, 30 fruit; every joint kicked at up to 1 rad/s before the first of 5 s; elapsed";
const SOFTWARE_NOTE: &str = "a software adapter: no target applies";

/// Measures substeps per second, memory and build time.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let gpu = Gpu::open(Choice::Any).context("the suite gpu needs a graphics adapter")?;
    let is_real = !gpu.info().is_software;
    let awake = if is_real { ScalingRules::of(&Protocol::paper())?.device.wake.si() } else { 0.0 };
    let bar = spinner();
    say(&bar, "growing trees");
    let kinds = if is_real && effort == Effort::Full { WORLDS } else { SOFTWARE_WORLDS };
    let spec = spec_with_fruit(FRUIT)?;
    let substeps = f64::from(spec.sim.substeps.get());
    let forest = nearest(spec, LINKS, kinds, SEARCHED)?;
    let typical = &forest[0];
    let siblings: Vec<Planting> = (0..kinds as u32).map(|index| typical.sibling(index)).collect();
    let [same, dimensions, topologies] = [std::slice::from_ref(typical), &siblings, &forest].map(settled);
    let (same, dimensions, topologies) = (same?, dimensions?, topologies?);

    let mut rows = Vec::new();
    let targets: &[(usize, f64)] = if is_real { &TARGETS } else { &[(SOFTWARE_WORLDS, 0.0)] };
    say(&bar, "MuJoCo-Warp");
    let compared: Vec<usize> =
        targets.iter().map(|&(worlds, _)| worlds).filter(|&worlds| worlds <= MANY).collect();
    // The file is kept, so that it can be stepped elsewhere.
    let tree = warp::leave(&mjcf_of(&same[0])?)?;
    let peer = if is_real { Peer::measure(&tree, &compared) } else { Err(SOFTWARE_NOTE.to_owned()) };
    let peer = peer.inspect_err(|why| eprintln!("NO COMPARISON with MuJoCo-Warp: {why}")).ok();
    let counters = if is_real { Counters::open(&gpu.info().name) } else { Err(SOFTWARE_NOTE.to_owned()) };
    let counters = counters.inspect_err(|why| eprintln!("NO COUNTERS: {why}")).ok();
    for &(worlds, target) in targets {
        say(&bar, &format!("{worlds} worlds"));
        let mut cell = Cell::measure(&gpu, &dimensions, worlds, awake)?;
        let name = format!("gpu.dimensions_{worlds}");
        let row = cell.row(&name, substeps);
        rows.push(if is_real {
            let row = peer.iter().fold(row, |row, peer| peer.beside(row, worlds));
            Row { note: Some(NOTE.to_owned()), ..row.at_least(target) }
        } else {
            Row { note: Some(SOFTWARE_NOTE.to_owned()), ..row }
        });
        rows.extend(Counters::rows_of(counters.as_ref(), &name, &mut cell.batch));
        if worlds == MANY {
            rows.push(
                Row::measured(&format!("gpu.dimensions_{worlds}.memory"), cell.bytes, "bytes")
                    .at_most(MEMORY),
            );
            let note = "time to pack and send settled trees".to_owned();
            let build =
                Row::measured(&format!("gpu.dimensions_{worlds}.build"), cell.build, "s").at_most(BUILD);
            rows.push(Row { note: Some(note), ..build });
            rows.push(drawn(&gpu, typical, worlds)?.at_most(BUILD));
        }
    }
    for &(worlds, _) in targets {
        say(&bar, &format!("{worlds} worlds of one topology and of many topologies"));
        let of_one = Cell::measure(&gpu, &same, worlds, awake)?;
        let of_many = Cell::measure(&gpu, &topologies, worlds, awake)?;
        rows.push(of_one.row(&format!("gpu.same_{worlds}"), substeps));
        rows.push(of_many.row(&format!("gpu.topologies_{worlds}"), substeps));
        let share = of_many.rates.median() / of_one.rates.median();
        let row = Row::measured(&format!("gpu.topologies_{worlds}.share"), share, "1");
        rows.push(if is_real && worlds == MANY { row.at_least(TOPOLOGIES) } else { row });
    }
    for &(worlds, _) in targets {
        say(&bar, &format!("{worlds} worlds on stems and in wind"));
        rows.extend(stems::rows(&gpu, typical, kinds, worlds, substeps, awake, counters.as_ref())?);
    }
    for &(worlds, _) in targets {
        say(&bar, &format!("{worlds} robots"));
        rows.extend(robots::rows(&gpu, worlds)?);
    }
    for &(worlds, _) in targets {
        say(&bar, &format!("{worlds} whole worlds"));
        rows.extend(worlds::rows(&gpu, &topologies, worlds)?);
    }
    bar.finish_and_clear();
    let info = gpu.info();
    rows.extend(peer.iter().flat_map(Peer::rows));
    let mut measured = Measured::from(rows);
    measured.context.insert("mujoco_warp", peer.as_ref().map(Peer::about));
    measured.context.insert("adapter", Some(info.name.clone()));
    measured.context.insert("driver", Some(info.driver.clone()));
    measured.context.insert("backend", Some(info.backend.clone()));
    Ok(measured)
}

/// Time in which the device draws the worlds from one tree, with every physical axis, and settles them. The kernels are compiled before.
fn drawn(gpu: &Gpu, of: &Planting, worlds: usize) -> anyhow::Result<Row> {
    let mut spec = Spec::clone(&of.spec);
    spec.randomisation = Spec::preset(Preset::Randomised).randomisation;
    spec.randomisation.mode = Mode::DistinctDimensions;
    let base = BaseTree::new(Arc::new(spec), &of.skeleton, of.fruit.clone(), SEED)?;
    GpuBatch::randomised(gpu, &base, 1)?.wait()?;
    let start = Instant::now();
    GpuBatch::randomised(gpu, &base, worlds as u32)?.wait()?;
    let row = Row::measured(&format!("gpu.drawn_{worlds}.build"), start.elapsed().as_secs_f64(), "s");
    let note = "from one tree in memory to all worlds in equilibrium; drawn and settled on the device";
    Ok(Row { note: Some(note.to_owned()), ..row })
}

fn settled(plantings: &[Planting]) -> anyhow::Result<Vec<TreeWorld>> {
    plantings
        .par_iter()
        .map(|planting| {
            Ok(TreeWorld::new(planting.spec.clone(), &planting.skeleton, planting.fruit.clone())?)
        })
        .collect()
}

/// `count` worlds that repeat the given trees, each with its own kick.
fn repeated(kinds: &[TreeWorld], count: usize) -> Vec<TreeWorld> {
    let world = |index: usize| {
        let mut world = kinds[index % kinds.len()].clone();
        kick(&mut world.data_mut().v, index as u32);
        world
    };
    (0..count).into_par_iter().map(world).collect()
}

/// Frames of a whole batch per second, over some frames.
fn rate_of(batch: &mut GpuBatch, frames: u32) -> anyhow::Result<f64> {
    let start = Instant::now();
    batch.advance(frames);
    batch.wait()?;
    Ok(f64::from(frames) / start.elapsed().as_secs_f64())
}

/// One batch, timed.
struct Cell {
    batch: GpuBatch,
    worlds: usize,
    /// Frames of the whole batch per second.
    rates: Rounds,
    bytes: f64,
    build: f64,
}

impl Cell {
    /// Makes `count` worlds that repeat the given trees, each with its own kick.
    fn measure(gpu: &Gpu, kinds: &[TreeWorld], worlds: usize, awake: f64) -> anyhow::Result<Self> {
        let all = repeated(kinds, worlds);
        let start = Instant::now();
        let mut batch = GpuBatch::new(gpu, &all)?;
        batch.wait()?;
        let build = start.elapsed().as_secs_f64();
        wake(gpu, &all[0], awake)?;
        drop(all);
        batch.advance(WARM_UP);
        batch.wait()?;
        let mut rates = Vec::with_capacity(ROUNDS);
        for _ in 0..ROUNDS {
            rates.push(rate_of(&mut batch, FRAMES)?);
        }
        Ok(Self { worlds, rates: Rounds::new(rates), bytes: batch.bytes() as f64, build, batch })
    }

    /// Substeps of one world per second.
    fn row(&self, name: &str, substeps: f64) -> Row {
        let each = self.worlds as f64 * substeps;
        let row = Row::measured(name, self.rates.median() * each, "substeps/s");
        Row { spread: Some(self.rates.spread().map(|rate| rate * each)), ..row }
    }
}
