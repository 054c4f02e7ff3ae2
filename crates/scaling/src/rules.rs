//! The scaling task's constants: the table `[scaling]` of the protocol.

use orchard_quantity::{ConfigError, Count, Quantity, Span};
use orchard_spec::randomisation::Mode;
use orchard_tasks::plan_file::Backend;
use orchard_tasks::protocol::Protocol;
use serde::{Deserialize, Serialize};

/// The scaling task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScalingRules {
    /// Default backend.
    pub backend: Backend,
    /// Frames of a course, which begins at the kick.
    pub frames: Count,
    /// Largest joint rate of a kick.
    pub kick: Quantity,
    /// Number of different trees; further worlds repeat them.
    pub kinds: Count,
    /// Constants of runs on a graphics device.
    pub device: DeviceRules,
    /// The official profile.
    pub full: Effort,
    /// The short profile.
    pub quick: Effort,
    /// The large sweep, `cargo xtask perf scaling`.
    pub study: StudyRules,
    /// The paper's figures.
    pub published: PublishedScaling,
}

impl ScalingRules {
    /// Reads the section `scaling` of a protocol.
    ///
    /// # Errors
    /// A field missing or unknown, or a value outside its range.
    pub fn of(protocol: &Protocol) -> Result<Self, ConfigError> {
        protocol.section("scaling")
    }
}

/// Constants of runs on a graphics device, where a batch is not reset between courses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeviceRules {
    /// Time for which the device is kept busy before a batch is timed, since the clocks of an idle device rise slowly.
    pub wake: Quantity,
    /// Frames of a batch before its first course.
    pub warm_up: Count,
    /// Frames of a course.
    pub frames: Count,
    /// Largest simulated time from the kick to the start of a course, within which everything still moves.
    pub simulated: Quantity,
    /// Worlds of the largest batch on a software adapter.
    pub software_worlds: Count,
    /// Frames of a course on a software adapter.
    pub software_frames: Count,
}

/// The large sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyRules {
    /// Largest estimated time of a cell; longer cells are skipped.
    pub cell_limit: Quantity,
    /// Largest fraction of the system's free memory for a cell; cells that need more are skipped.
    pub memory_share: Quantity,
    /// Effort on the CPU.
    pub cpu: Effort,
    /// Effort on a graphics device.
    pub gpu: Effort,
    /// Effort of a smoke test.
    pub quick: Effort,
    /// Cost of each kind of randomisation.
    pub axes: AxesRules,
}

impl StudyRules {
    /// Amount of measurement on a backend.
    pub fn effort(&self, backend: Backend) -> &Effort {
        match backend {
            Backend::Cpu => &self.cpu,
            Backend::Gpu => &self.gpu,
        }
    }
}

/// Rules for timing each kind of randomisation alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxesRules {
    /// Settled worlds of a batch.
    pub worlds: Count,
    /// Factors on the damping of wood, which no axis of the presets varies: a geometric sequence from the first world to the last.
    pub damping: Span,
}

/// Amount of measurement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Effort {
    /// Worlds of the largest batch.
    pub most_worlds: Count,
    /// Ratio of the worlds of successive batches; the first batch has one world.
    pub factor: Count,
    /// Repeats of a cell.
    pub repeats: Count,
    /// Time for all repeats of a cell; a repeat has at least one course.
    pub cell_time: Quantity,
}

impl Effort {
    /// Worlds of every batch, ascending: 1, `factor`, its square and so on, and `most_worlds`.
    pub fn worlds(&self) -> Vec<u32> {
        let (most, factor) = (self.most_worlds.get(), self.factor.get());
        let mut worlds = Vec::new();
        let mut next = Some(1);
        while let Some(count) = next.filter(|count| *count < most) {
            worlds.push(count);
            next = u32::checked_mul(count, factor);
        }
        worlds.push(most);
        worlds
    }
}

/// Figures of the paper; for comparison only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedScaling {
    /// Env-steps per second.
    pub env_steps_per_s: Vec<PublishedRate>,
    /// Time to build the worlds.
    pub build: Vec<PublishedBuild>,
    /// Solvers of the paper.
    pub solvers: Vec<PublishedSolver>,
}

impl PublishedScaling {
    /// The figure of a mode at a number of worlds.
    pub fn at(&self, mode: Mode, worlds: u32) -> Option<&PublishedRate> {
        self.env_steps_per_s.iter().find(|rate| (rate.mode, rate.worlds) == (mode, worlds))
    }

    /// The time to build some worlds of a mode.
    pub fn build_at(&self, mode: Mode, worlds: u32) -> Option<&PublishedBuild> {
        self.build.iter().find(|build| (build.mode, build.worlds) == (mode, worlds))
    }
}

/// A rate of the paper.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedRate {
    /// Mode: the differences between worlds.
    pub mode: Mode,
    /// Worlds.
    pub worlds: u32,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Unit.
    pub unit: String,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
}

/// A time to build worlds, of the paper.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedBuild {
    /// Mode: the differences between worlds.
    pub mode: Mode,
    /// Worlds.
    pub worlds: u32,
    /// The time.
    pub value: f64,
    /// Unit.
    pub unit: String,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
}

/// A solver of the paper: its largest batch and the cost of that batch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedSolver {
    /// Name.
    pub name: String,
    /// Worlds of its largest batch.
    pub most_worlds: u32,
    /// Memory of its largest batch, if the paper gives it.
    pub memory: Option<f64>,
    /// Ratio of the step time to that of the first solver: smallest and largest.
    pub slower: [f64; 2],
    /// Ratio of the memory to that of the first solver.
    pub heavier: f64,
    /// Unit of the memory.
    pub unit: String,
    /// Key of the source in `docs/references.bib`.
    pub source: String,
}
