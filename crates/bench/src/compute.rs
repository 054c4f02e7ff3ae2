//! What a clock or the machine can change, and nothing else: `compute.json`.

use serde::{Deserialize, Serialize};

use crate::episode::SCHEMA_VERSION;

/// The machine that a result was computed on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Operating system.
    pub os: String,
    /// Instruction set.
    pub arch: String,
    /// Processor, as the system names it.
    pub cpu: Option<String>,
    /// Logical processors that this process may use.
    pub logical_cpus: u32,
}

impl Machine {
    /// This machine.
    pub fn detect() -> Self {
        let field = |text: String| {
            let line = text.lines().find(|line| line.starts_with("model name"))?.to_owned();
            Some(line.split_once(':')?.1.trim().to_owned())
        };
        Self {
            os: std::env::consts::OS.to_owned(),
            arch: std::env::consts::ARCH.to_owned(),
            cpu: std::fs::read_to_string("/proc/cpuinfo").ok().and_then(field),
            logical_cpus: std::thread::available_parallelism().map_or(1, |n| n.get() as u32),
        }
    }
}

/// Largest resident memory of this process so far [MiB], where the system tells.
pub fn peak_memory_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}

/// Cost of one episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeCost {
    /// File of the episode.
    pub file: String,
    /// Wall time of this run [s]; null where a stored episode was reused.
    pub wall_s: Option<f64>,
}

/// Cost of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Compute {
    /// Layout version.
    pub schema_version: u32,
    /// Machine.
    pub machine: Machine,
    /// Threads.
    pub threads: u32,
    /// Wall time of the run [s].
    pub wall_s: f64,
    /// Env-steps (frames of one world) that this run computed.
    pub env_steps: u64,
    /// Env-steps a wall second.
    pub env_steps_per_s: Option<f64>,
    /// Simulated seconds, summed over worlds, a wall second.
    pub world_seconds_per_s: Option<f64>,
    /// Peak resident memory [MiB].
    pub peak_memory_mib: Option<f64>,
    /// Cost of every episode.
    pub episodes: Vec<EpisodeCost>,
}

impl Compute {
    /// Sums up a run: `steps` env-steps of `frame` seconds in `wall_s` seconds.
    pub fn of_run(threads: u32, wall_s: f64, steps: u64, frame: f64, episodes: Vec<EpisodeCost>) -> Self {
        let rate = (steps > 0 && wall_s > 0.0).then(|| steps as f64 / wall_s);
        Self {
            schema_version: SCHEMA_VERSION,
            machine: Machine::detect(),
            threads,
            wall_s,
            env_steps: steps,
            env_steps_per_s: rate,
            world_seconds_per_s: rate.map(|rate| rate * frame),
            peak_memory_mib: peak_memory_mib(),
            episodes,
        }
    }
}
