//! Runs a scaling plan, cell by cell.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use orchard_batch::{BatchError, Isa, TreeWorld};
use orchard_spec::randomisation::Mode;
use rayon::ThreadPool;

use super::cell::{Start, time};
use super::plan::{Cell, ScalingPlan, SolverName};
use super::process::resident_bytes;
use super::results::{Batched, MemoryBasis, Row, Scaling};
use super::trees;
use crate::compute::{Machine, peak_memory_mib};
use crate::episode::{CODE_VERSION, SCHEMA_VERSION};
use crate::store::{Store, StoreError};

/// Name of the result file.
pub const RESULT: &str = "scaling.json";

/// A scaling run that did not end.
#[derive(Debug, thiserror::Error)]
pub enum ScalingError {
    /// The plan has no cell, or more worlds in one than in a later one.
    #[error(
        "no cell to time: modes, worlds (ascending, from 1) and solvers are needed, and at least one repeat of one frame"
    )]
    NoCells,
    /// The plan names a solver that this build lacks.
    #[error("this build has no solver {}: it needs the feature `cholesky`", .0.name())]
    NotBuilt(SolverName),
    /// A world cannot be built.
    #[error("a world of mode {mode:?} cannot be built: {reason}")]
    World {
        /// Its mode.
        mode: Mode,
        /// Why.
        reason: String,
    },
    /// Worlds make no batch.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// The threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The result file cannot be written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The stop flag was raised. Figures of one file belong to one run, so nothing is kept.
    #[error("interrupted after {done} of {total} cells of the scaling task, which begins anew")]
    Interrupted {
        /// Cells that were timed.
        done: usize,
        /// Cells planned.
        total: usize,
    },
}

/// Hears how a run goes on.
pub trait ScalingProgress {
    /// The worlds of a mode are being built.
    fn building(&self, mode: Mode, worlds: u32) {
        let _ = (mode, worlds);
    }
    /// A cell is timed.
    fn row(&self, row: &Row) {
        let _ = row;
    }
}

impl ScalingProgress for crate::Silent {}

/// Times every cell on `threads` threads and writes `scaling.json`.
///
/// # Errors
/// A plan without cells, a solver that is not built, worlds that cannot be built, a file that cannot be written, or `stop` was raised.
pub fn run(
    plan: &ScalingPlan,
    store: &Store,
    threads: usize,
    stop: &AtomicBool,
    progress: &impl ScalingProgress,
) -> Result<Scaling, ScalingError> {
    plan.check()?;
    let start = Instant::now();
    store.remove(RESULT)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let memory = memory_of_worlds(plan, &pool)?;
    let mut rows = Vec::new();
    for (&mode, each) in plan.modes.iter().zip(memory) {
        rows_of(plan, mode, each, &pool, stop, progress, &mut rows)?;
    }
    let sim = trees::spec_of(Mode::Homogeneous).sim;
    let scaling = Scaling {
        schema_version: SCHEMA_VERSION,
        code_version: CODE_VERSION.to_owned(),
        config_version: plan.config_version.clone(),
        profile: plan.profile.clone(),
        machine: Machine::detect(),
        instructions: format!("{:?}", Isa::best()),
        threads: threads as u32,
        seed: plan.seed,
        frame_s: sim.frame(),
        substeps: sim.substeps.get(),
        frames: plan.frames,
        wall_s: start.elapsed().as_secs_f64(),
        peak_memory_mib: peak_memory_mib(),
        left_out: SolverName::ALL.into_iter().filter(|solver| !plan.solvers.contains(solver)).collect(),
        rows,
    };
    store.write(RESULT, &scaling)?;
    Ok(scaling)
}

/// Worlds a mode whose memory is measured: so many that what building them leaves behind hardly counts.
const MEASURED_WORLDS: u32 = 64;

/// By how much the process grows by a world in f64 [bytes], by mode. All worlds are kept until the last are measured, since freed
/// memory is taken again before the process grows.
fn memory_of_worlds(plan: &ScalingPlan, pool: &ThreadPool) -> Result<Vec<Option<f64>>, ScalingError> {
    let count = plan.worlds.last().copied().unwrap_or_default().min(MEASURED_WORLDS);
    let mut kept = Vec::new();
    let mut memory = Vec::new();
    for &mode in &plan.modes {
        let before = resident_bytes();
        kept.push(built(plan, mode, count, pool)?);
        let growth = resident_bytes().zip(before).map(|(after, before)| (after - before).max(0.0));
        memory.push(growth.map(|growth| growth / f64::from(count)));
    }
    Ok(memory)
}

fn built(
    plan: &ScalingPlan,
    mode: Mode,
    count: u32,
    pool: &ThreadPool,
) -> Result<Vec<TreeWorld>, ScalingError> {
    pool.install(|| trees::worlds(plan, mode, count)).map_err(|reason| ScalingError::World { mode, reason })
}

/// The cells of one mode, whose worlds are built once; in f64 each takes `each` bytes.
fn rows_of(
    plan: &ScalingPlan,
    mode: Mode,
    each: Option<f64>,
    pool: &ThreadPool,
    stop: &AtomicBool,
    progress: &impl ScalingProgress,
    rows: &mut Vec<Row>,
) -> Result<(), ScalingError> {
    let interrupted = |done| ScalingError::Interrupted { done, total: plan.cells().len() };
    if stop.load(Ordering::Relaxed) {
        return Err(interrupted(rows.len()));
    }
    let most = plan.worlds.last().copied().unwrap_or_default();
    progress.building(mode, most);
    let all = built(plan, mode, most, pool)?;
    for cell in plan.cells_of(mode) {
        let worlds = &all[..cell.worlds as usize];
        let start = Start::new(worlds, cell.solver)?;
        let Some(timed) = time(plan, &start, pool, stop) else { return Err(interrupted(rows.len())) };
        let row = Row::new(&cell, plan.frames, &timed, &batched(&cell, &start, worlds, each));
        progress.row(&row);
        rows.push(row);
    }
    Ok(())
}

/// What the cell's worlds are; `each` is what one of them takes in f64 [bytes].
fn batched(cell: &Cell, start: &Start<'_>, worlds: &[TreeWorld], each: Option<f64>) -> Batched {
    let memory = match start {
        Start::Lanes(batch) => (Some(batch.bytes() as f64), MemoryBasis::Numbers),
        Start::Each(..) => (each.map(|each| each * f64::from(cell.worlds)), MemoryBasis::Growth),
    };
    let mean =
        |of: fn(&TreeWorld) -> usize| worlds.iter().map(of).sum::<usize>() as f64 / worlds.len() as f64;
    Batched {
        memory,
        segments: mean(|world| world.plant().tree.len()),
        fruit: mean(|world| world.plant().fruit.len()),
    }
}

impl ScalingPlan {
    /// Checks that every cell can be timed.
    ///
    /// # Errors
    /// No cell, worlds that do not ascend from 1, no repeat, no frame, a solver that this build lacks.
    pub fn check(&self) -> Result<(), ScalingError> {
        let counts =
            self.repeats > 0 && self.frames > 0 && self.worlds.first().is_some_and(|&first| first > 0);
        if !counts || !self.worlds.is_sorted_by(|a, b| a < b) || self.cells().is_empty() {
            return Err(ScalingError::NoCells);
        }
        match self.solvers.iter().find(|solver| !solver.is_built()) {
            Some(&solver) => Err(ScalingError::NotBuilt(solver)),
            None => Ok(()),
        }
    }
}
