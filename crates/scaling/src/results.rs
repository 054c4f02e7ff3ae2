//! `scaling.json`.

use orchard_bench::compute::Machine;
use orchard_spec::randomisation::Mode;
use orchard_statistics::quantile::{ascending, quantile};
use orchard_tasks::plan_file::Backend;
use serde::{Deserialize, Serialize};

use crate::axes::AxisRow;
use crate::cell::CellTiming;
use crate::device::GpuInfo;
use crate::plan::{Cell, ScalingPlan};
use crate::solver::SolverName;

/// Results of a scaling run. They depend on the clock and the machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scaling {
    /// Layout version.
    pub schema_version: u32,
    /// Code version.
    pub code_version: String,
    /// Version of protocol and configs.
    pub config_version: String,
    /// Profile.
    pub profile: String,
    /// Backend that advanced the batches.
    #[serde(default)]
    pub backend: Backend,
    /// The graphics device; null on the CPU.
    #[serde(default)]
    pub adapter: Option<Adapter>,
    /// Machine.
    pub machine: Machine,
    /// Instructions of the lanes.
    pub instructions: String,
    /// Threads that share a batch.
    pub threads: u32,
    /// Seed of all trees and kicks.
    pub seed: u64,
    /// Length of a frame \[s\].
    pub frame_s: f64,
    /// Substeps of a frame.
    pub substeps: u32,
    /// Frames of a course.
    pub frames: u32,
    /// Wall time of the run, including building the worlds \[s\].
    pub wall_s: f64,
    /// Largest resident memory of the process so far \[MiB\], where the system reports it.
    pub peak_memory_mib: Option<f64>,
    /// Solvers of the backend that this build lacks.
    pub left_out: Vec<SolverName>,
    /// One row per cell.
    pub rows: Vec<Row>,
    /// Skipped cells.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub omitted: Vec<Omitted>,
    /// Cost of each kind of randomisation, if measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub axes: Vec<AxisRow>,
}

/// A graphics device.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Adapter {
    /// Name.
    pub name: String,
    /// Driver, with its version.
    pub driver: String,
    /// Vulkan, Metal or DX12.
    pub api: String,
    /// True for a software adapter.
    pub is_software: bool,
}

impl From<&GpuInfo> for Adapter {
    fn from(info: &GpuInfo) -> Self {
        let GpuInfo { name, driver, backend, is_software, .. } = info;
        Self { name: name.clone(), driver: driver.clone(), api: backend.clone(), is_software: *is_software }
    }
}

/// A skipped cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Omitted {
    /// Solver.
    pub solver: SolverName,
    /// Mode: the differences between the worlds.
    pub mode: Mode,
    /// Worlds.
    pub worlds: u32,
    /// Reason.
    pub why: String,
}

/// Way in which the memory of a cell was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MemoryBasis {
    /// Memory of the numbers read and written by a step, on the device if there is one.
    Numbers,
    /// Growth of the process by as many worlds (states and models), without the solver's own memory.
    Growth,
}

/// One cell: a batch under a solver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Solver.
    pub solver: SolverName,
    /// Mode: the differences between the worlds.
    pub mode: Mode,
    /// Worlds.
    pub worlds: u32,
    /// Frames of the whole batch per second of elapsed time: the median of the repeats.
    pub step_rate_per_s: f64,
    /// Step rate times the number of worlds: frames of one world per second.
    pub env_steps_per_s: f64,
    /// Env-step rate times the substeps of a frame: substeps of one world per second.
    pub substeps_per_s: f64,
    /// Smallest and largest step rate of the repeats \[1/s\].
    pub spread: [f64; 2],
    /// Processor time of all threads per env-step \[us\], over all repeats; hardly affected by other work on the machine.
    pub processor_us_per_env_step: f64,
    /// Memory of the batch \[MiB\]; null where the system does not report it.
    pub memory_mib: Option<f64>,
    /// Way in which `memory_mib` was measured.
    pub memory_basis: MemoryBasis,
    /// Time to grow the worlds' plants and let them settle \[s\], on all threads.
    pub grow_s: f64,
    /// Time to kick the worlds, make the solver's batch and, on a device, send it \[s\].
    pub pack_s: f64,
    /// Segments of a tree on average.
    pub segments_per_tree: f64,
    /// Fruit of a tree on average.
    pub fruit_per_tree: f64,
    /// Number of repeats.
    pub repeats: u32,
    /// Number of courses in all repeats.
    pub courses: u32,
    /// Number of worlds that were not finite at the end of a course; if not 0, the figures of the cell are invalid.
    pub unfinite: u32,
    /// Remark.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// Values that all cells with the same worlds share.
#[derive(Debug, Clone, Copy)]
pub struct Batched {
    /// Memory \[bytes\] and how it was measured.
    pub memory: (Option<f64>, MemoryBasis),
    /// Time to grow them \[s\].
    pub grow_s: f64,
    /// Substeps of a frame.
    pub substeps: u32,
    /// Segments of a tree on average.
    pub segments: f64,
    /// Fruit of a tree on average.
    pub fruit: f64,
}

impl Row {
    /// Time to build a batch: growing and packing \[s\].
    pub fn build_s(&self) -> f64 {
        self.grow_s + self.pack_s
    }

    /// The figures of a plan's cell.
    pub(crate) fn new(cell: &Cell, plan: &ScalingPlan, timed: &CellTiming, batched: &Batched) -> Self {
        let rates = ascending(timed.rates.iter().copied());
        let rate = |p: f64| quantile(&rates, p).unwrap_or_default();
        let worlds = f64::from(cell.worlds);
        let env_steps = worlds * f64::from(plan.frames) * f64::from(timed.courses);
        let (bytes, memory_basis) = batched.memory;
        Self {
            solver: cell.solver,
            mode: cell.mode,
            worlds: cell.worlds,
            step_rate_per_s: rate(0.5),
            env_steps_per_s: rate(0.5) * worlds,
            substeps_per_s: rate(0.5) * worlds * f64::from(batched.substeps),
            spread: [rate(0.0), rate(1.0)],
            processor_us_per_env_step: 1e6 * timed.processor_s / env_steps,
            memory_mib: bytes.map(|bytes| bytes / BYTES_PER_MIB),
            memory_basis,
            grow_s: batched.grow_s,
            pack_s: timed.pack_s,
            segments_per_tree: batched.segments,
            fruit_per_tree: batched.fruit,
            repeats: timed.rates.len() as u32,
            courses: timed.courses,
            unfinite: timed.unfinite,
            note: plan.note.clone(),
        }
    }
}

/// Bytes of a mebibyte.
pub(crate) const BYTES_PER_MIB: f64 = 1_048_576.0;
