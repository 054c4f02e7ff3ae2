//! Runs a scaling plan, cell by cell.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use orchard_batch::Isa;
use orchard_bench::compute::{Machine, peak_memory_mib};
use orchard_bench::store::Store;
use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_spec::randomisation::Mode;
use rayon::ThreadPool;

use crate::axes;
use crate::cell::{BatchStart, CellTiming, time};
use crate::device::{self, Gpu};
use crate::error::ScalingError;
use crate::plan::{Cell, ScalingPlan};
use crate::process::{available_bytes, resident_bytes};
use crate::results::{BYTES_PER_MIB, Batched, MemoryBasis, Omitted, Row, Scaling};
use crate::solver::SolverName;
use crate::trees::{self, Forest, Worlds};

/// Name of the result file.
pub const RESULT: &str = "scaling.json";

/// Progress of a scaling run; the methods are called during the run.
pub trait ScalingProgress {
    /// The worlds of a mode are being built.
    fn building(&self, mode: Mode, worlds: u32) {
        let _ = (mode, worlds);
    }
    /// A cell is timed.
    fn row(&self, row: &Row) {
        let _ = row;
    }
    /// A cell is skipped.
    fn omitted(&self, omitted: &Omitted) {
        let _ = omitted;
    }
    /// The kinds of randomisation are being timed.
    fn axes(&self) {}
}

impl ScalingProgress for orchard_bench::NoProgress {}

/// Times every cell on `threads` threads, or on a device, and writes `scaling.json`.
///
/// # Errors
/// As [`measure`], or the file cannot be written.
pub fn run(
    plan: &ScalingPlan,
    gpu: Option<&Gpu>,
    store: &Store,
    threads: usize,
    stop: &AtomicBool,
    progress: &impl ScalingProgress,
) -> Result<Scaling, ScalingError> {
    plan.check()?;
    store.remove(RESULT)?;
    let scaling = measure(plan, gpu, threads, stop, progress)?;
    store.write(RESULT, &scaling)?;
    Ok(scaling)
}

/// Times every cell on `threads` threads, or on a device.
///
/// # Errors
/// A plan without cells, a missing solver, worlds that cannot be built, a device failure, or `stop` was raised.
pub fn measure(
    plan: &ScalingPlan,
    gpu: Option<&Gpu>,
    threads: usize,
    stop: &AtomicBool,
    progress: &impl ScalingProgress,
) -> Result<Scaling, ScalingError> {
    plan.check()?;
    let start = Instant::now();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let memory = memory_of_worlds(plan, &pool)?;
    let mut run = Run { plan, gpu, pool: &pool, stop, progress, rows: Vec::new(), omitted: Vec::new() };
    for (&mode, each) in plan.modes.iter().zip(memory) {
        run.mode(mode, each)?;
    }
    let axes = match &plan.axes {
        None => Vec::new(),
        Some(axes) => {
            progress.axes();
            axes::rows(plan, axes, gpu, &pool, stop)?.ok_or_else(|| run.interrupted())?
        }
    };
    let sim = &plan.spec.sim;
    let is_left_out = |solver: &SolverName| solver.backend() == plan.backend && !solver.is_built();
    Ok(Scaling {
        schema_version: SCHEMA_VERSION,
        code_version: CODE_VERSION.to_owned(),
        config_version: plan.config_version.clone(),
        profile: plan.profile.clone(),
        backend: plan.backend,
        adapter: gpu.map(|gpu| gpu.info().into()),
        machine: Machine::detect(),
        instructions: format!("{:?}", Isa::best()),
        threads: threads as u32,
        seed: plan.seed,
        frame_s: sim.frame(),
        substeps: sim.substeps.get(),
        frames: plan.frames,
        wall_s: start.elapsed().as_secs_f64(),
        peak_memory_mib: peak_memory_mib(),
        left_out: SolverName::ALL.into_iter().filter(is_left_out).collect(),
        rows: run.rows,
        omitted: run.omitted,
        axes,
    })
}

/// Number of worlds per mode whose memory is measured: enough to make memory left over from building them negligible.
const MEASURED_WORLDS: u32 = 64;

/// Measures the memory growth of the process per world in f64 \[bytes\], by mode. All worlds are kept until the last measurement, because
/// freed memory would be reused without growth.
fn memory_of_worlds(plan: &ScalingPlan, pool: &ThreadPool) -> Result<Vec<Option<f64>>, ScalingError> {
    let count = plan.worlds.last().copied().unwrap_or_default().min(MEASURED_WORLDS);
    let mut kept = Vec::new();
    let mut memory = Vec::new();
    for &mode in &plan.modes {
        let before = resident_bytes();
        let worlds = pool.install(|| trees::worlds(plan, mode, count));
        kept.push(worlds.map_err(|reason| ScalingError::World { mode, reason })?);
        let growth = resident_bytes().zip(before).map(|(after, before)| (after - before).max(0.0));
        memory.push(growth.map(|growth| growth / f64::from(count)));
    }
    Ok(memory)
}

/// State of a running measurement.
struct Run<'a, P> {
    plan: &'a ScalingPlan,
    gpu: Option<&'a Gpu>,
    pool: &'a ThreadPool,
    stop: &'a AtomicBool,
    progress: &'a P,
    rows: Vec<Row>,
    omitted: Vec<Omitted>,
}

impl<P: ScalingProgress> Run<'_, P> {
    /// Times the cells of one mode, whose worlds are grown once; each world takes `each` bytes in f64.
    fn mode(&mut self, mode: Mode, each: Option<f64>) -> Result<(), ScalingError> {
        let (plan, pool) = (self.plan, self.pool);
        self.progress.building(mode, plan.worlds.last().copied().unwrap_or_default());
        let mut forest = Forest::new(plan, mode);
        for cell in plan.cells_of(mode) {
            if self.stop.load(Ordering::Relaxed) {
                return Err(self.interrupted());
            }
            if let Some(why) = self.omission_reason(&cell, each) {
                self.omit(&cell, why);
                continue;
            }
            let grown = pool.install(|| forest.grow(cell.worlds));
            grown.map_err(|reason| ScalingError::World { mode, reason })?;
            let worlds = Worlds { count: cell.worlds, world: &|index| forest.world(index) };
            let start = BatchStart { worlds, solver: cell.solver, gpu: self.gpu };
            match time(plan, &start, pool, self.stop) {
                Ok(None) => return Err(self.interrupted()),
                Ok(Some(timed)) => {
                    let row = Row::new(&cell, plan, &timed, &batched(&cell, &timed, &forest, each));
                    self.progress.row(&row);
                    self.rows.push(row);
                }
                // Without limits no cell is skipped.
                Err(ScalingError::Gpu(e)) if plan.limits.is_some() && device::is_too_large(&e) => {
                    self.omit(&cell, e.to_string());
                }
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }

    fn omit(&mut self, cell: &Cell, why: String) {
        let &Cell { mode, worlds, solver } = cell;
        let omitted = Omitted { solver, mode, worlds, why };
        self.progress.omitted(&omitted);
        self.omitted.push(omitted);
    }

    /// Reason for skipping a cell, if any, estimated from the previous smaller cell and the free memory.
    fn omission_reason(&self, cell: &Cell, each: Option<f64>) -> Option<String> {
        let limits = self.plan.limits?;
        let before = self.rows.iter().rev().find(|row| (row.mode, row.solver) == (cell.mode, cell.solver));
        if let Some(before) = before {
            let frames = f64::from(self.plan.repeats) * f64::from(self.plan.frames);
            let least = frames * f64::from(cell.worlds) / before.env_steps_per_s;
            if least > limits.cell_time {
                let limit = limits.cell_time;
                return Some(format!("estimated time {least:.0} s, limit {limit:.0} s"));
            }
        }
        let (free, each) = available_bytes().zip(each)?;
        let more = bytes_needed(cell, each, before);
        let has = limits.memory_share * free;
        let mib = |bytes: f64| bytes / BYTES_PER_MIB;
        (more > has).then(|| format!("estimated memory {:.0} MiB, limit {:.0} MiB", mib(more), mib(has)))
    }

    fn interrupted(&self) -> ScalingError {
        ScalingError::Interrupted { done: self.rows.len(), total: self.plan.cells().len() }
    }
}

/// Estimates the memory of a cell \[bytes\]: worlds in f64 of `each` bytes, and the batch's own numbers, scaled from a smaller cell.
pub(crate) fn bytes_needed(cell: &Cell, each: f64, smaller: Option<&Row>) -> f64 {
    let numbers = smaller.filter(|row| row.memory_basis == MemoryBasis::Numbers).and_then(|row| {
        Some(row.memory_mib? * BYTES_PER_MIB * f64::from(cell.worlds) / f64::from(row.worlds))
    });
    f64::from(cell.solver.at_once(cell.worlds)) * each + numbers.unwrap_or_default()
}

/// Returns the shared values of a cell's worlds; `each` is the memory of one world in f64 \[bytes\].
fn batched(cell: &Cell, timed: &CellTiming, forest: &Forest<'_>, each: Option<f64>) -> Batched {
    let memory = match timed.bytes {
        Some(bytes) => (Some(bytes as f64), MemoryBasis::Numbers),
        None => (each.map(|each| each * f64::from(cell.worlds)), MemoryBasis::Growth),
    };
    Batched {
        memory,
        grow_s: forest.grow_s,
        substeps: forest.world(0).plant().spec.sim.substeps.get(),
        segments: forest.mean(cell.worlds, |world| world.plant().tree.len()),
        fruit: forest.mean(cell.worlds, |world| world.plant().fruit.len()),
    }
}
