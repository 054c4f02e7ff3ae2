//! The cost of runs, `compute.json`: all figures that depend on a clock or on the machine.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::store::{Store, StoreError};
use crate::version::SCHEMA_VERSION;

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

/// Largest resident memory of this process so far \[MiB\], where the system reports it.
pub fn peak_memory_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}

/// Cost of one record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordCost {
    /// File.
    pub file: String,
    /// Wall time \[s\] of one thread; null where a stored record was reused.
    pub wall_s: Option<f64>,
}

/// Cost of a run of one task: the paper's compute metric.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaskCost {
    /// Machine.
    pub machine: Machine,
    /// Threads.
    pub threads: u32,
    /// Wall time of the run \[s\].
    pub wall_s: f64,
    /// Env-steps (frames of one world) that this run computed; images in the detection task.
    pub env_steps: u64,
    /// Frames per second of one world on one thread, including its controller and camera.
    pub step_rate_per_s: Option<f64>,
    /// Env-steps per wall second, all threads together.
    pub env_steps_per_s: Option<f64>,
    /// Simulated seconds, summed over worlds, per wall second; null for tasks without motion.
    pub world_seconds_per_s: Option<f64>,
    /// Records an hour of one thread, of those that this run computed.
    #[serde(default)]
    pub records_per_core_hour: Option<f64>,
    /// Peak resident memory of the process up to the end of this task \[MiB\].
    pub peak_memory_mib: Option<f64>,
    /// Cost of every record.
    pub records: Vec<RecordCost>,
}

/// An hour \[s\].
const HOUR: f64 = 3600.0;

impl TaskCost {
    /// Sums up a run: `steps` env-steps of `frame` seconds in `wall_s` seconds.
    pub fn of_run(threads: usize, wall_s: f64, steps: u64, frame: f64, records: Vec<RecordCost>) -> Self {
        let walls = || records.iter().filter_map(|record| record.wall_s);
        let busy: f64 = walls().sum();
        let rate = |seconds: f64| (steps > 0 && seconds > 0.0).then(|| steps as f64 / seconds);
        let env_steps_per_s = rate(wall_s);
        Self {
            machine: Machine::detect(),
            threads: threads as u32,
            wall_s,
            env_steps: steps,
            step_rate_per_s: rate(busy),
            env_steps_per_s,
            world_seconds_per_s: env_steps_per_s.map(|rate| rate * frame).filter(|rate| *rate > 0.0),
            records_per_core_hour: (busy > 0.0).then(|| HOUR * walls().count() as f64 / busy),
            peak_memory_mib: peak_memory_mib(),
            records,
        }
    }
}

/// Costs by task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Compute {
    /// Layout version.
    pub schema_version: u32,
    /// The last run of each task into this folder.
    pub tasks: BTreeMap<String, TaskCost>,
}

impl Compute {
    /// File under the result folder.
    pub const FILE: &'static str = "compute.json";

    /// Writes a task's cost into a folder's file and keeps those of other tasks.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn note(store: &Store, task: &str, cost: TaskCost) -> Result<(), StoreError> {
        // A damaged file is replaced: no result depends on it.
        let stored = store.read(Self::FILE).ok().flatten();
        let stored = stored.and_then(|bytes| serde_json::from_slice::<Self>(&bytes).ok());
        let mut compute = stored
            .filter(|compute| compute.schema_version == SCHEMA_VERSION)
            .unwrap_or(Self { schema_version: SCHEMA_VERSION, tasks: BTreeMap::new() });
        compute.tasks.insert(task.to_owned(), cost);
        store.write(Self::FILE, &compute)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_of_what_was_computed() {
        let record = |wall_s| RecordCost { file: "x".into(), wall_s };
        let cost =
            TaskCost::of_run(2, 5.0, 600, 0.5, vec![record(Some(4.0)), record(None), record(Some(6.0))]);
        assert_eq!(cost.step_rate_per_s, Some(60.0));
        assert_eq!(cost.records_per_core_hour, Some(720.0));
        assert_eq!((cost.env_steps_per_s, cost.world_seconds_per_s), (Some(120.0), Some(60.0)));
        let reused = TaskCost::of_run(2, 5.0, 0, 0.5, vec![record(None)]);
        assert_eq!((reused.step_rate_per_s, reused.env_steps_per_s), (None, None));
        assert_eq!(reused.records_per_core_hour, None);
    }

    #[test]
    fn tasks_stand_side_by_side() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let cost = |wall_s| TaskCost::of_run(1, wall_s, 1, 1.0, Vec::new());
        for (task, wall_s) in [("harvest", 1.0), ("detect", 2.0), ("harvest", 3.0)] {
            Compute::note(&store, task, cost(wall_s)).unwrap();
        }
        let text = std::fs::read_to_string(folder.path().join(Compute::FILE)).unwrap();
        let compute: Compute = serde_json::from_str(&text).unwrap();
        let walls: Vec<(&str, f64)> =
            compute.tasks.iter().map(|(name, c)| (name.as_str(), c.wall_s)).collect();
        assert_eq!(walls, [("detect", 2.0), ("harvest", 3.0)]);
    }
}
