//! `plan.json`: the plan of each task of a folder. The plan, the configs and the code determine the results.

use std::collections::BTreeMap;
use std::io;

use orchard_bench::Shard;
use orchard_bench::checksum::{Damage, checked};
use orchard_bench::store::{Store, StoreError};
use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_scenario::StoredScenario;
use serde::{Deserialize, Serialize};

pub use crate::backend::Backend;
use crate::harvest::plan::Extent;
use crate::protocol::Protocol;

/// The plan of one task, as requested by the user.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "task", rename_all = "kebab-case")]
pub enum TaskPlan {
    /// The harvest: conditions of the matrix.
    Harvest {
        /// Conditions, seeds and trees.
        #[serde(flatten)]
        extent: Extent,
        /// Backend that moves the worlds.
        #[serde(default, skip_serializing_if = "Backend::is_cpu")]
        backend: Backend,
    },
    /// Detection: single images of every tree.
    Detect {
        /// Seeds and trees.
        #[serde(flatten)]
        trees: TreeExtent,
    },
    /// Reach and grasp: hold named fruit.
    ReachAndGrasp {
        /// Seeds and trees.
        #[serde(flatten)]
        trees: TreeExtent,
        /// Backend that moves the worlds.
        #[serde(default, skip_serializing_if = "Backend::is_cpu")]
        backend: Backend,
    },
    /// Gentle interaction: push through the canopy.
    Gentle {
        /// Seeds and trees.
        #[serde(flatten)]
        trees: TreeExtent,
        /// Backend that moves the worlds.
        #[serde(default, skip_serializing_if = "Backend::is_cpu")]
        backend: Backend,
    },
    /// Scaling: time batches of trees.
    Scaling {
        /// Profile.
        profile: String,
        /// Backend that advances the batches.
        #[serde(default)]
        backend: Backend,
    },
}

/// Trees of a task without conditions.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TreeExtent {
    /// Profile whose defaults these are.
    pub profile: String,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Trees per seed.
    pub trees: u32,
}

impl TaskPlan {
    /// The task's name.
    pub fn task(&self) -> &'static str {
        match self {
            Self::Harvest { .. } => "harvest",
            Self::Detect { .. } => "detect",
            Self::ReachAndGrasp { .. } => "reach-and-grasp",
            Self::Gentle { .. } => "gentle",
            Self::Scaling { .. } => "scaling",
        }
    }

    /// Checks the numbers of a plan that was read from a file against the ranges that the command line has.
    ///
    /// # Errors
    /// A number outside its range; the error names it.
    pub fn check(&self, protocol: &Protocol) -> Result<(), String> {
        let trees = |trees: u32| {
            protocol
                .full
                .trees
                .with_value(trees)
                .map_err(|e| format!("{}: trees: {e}", self.task()))
                .map(drop)
        };
        match self {
            Self::Harvest { extent, .. } => {
                let horizon = &protocol.full.horizon;
                let repeats = protocol.official_set().repeats.with_value(extent.repeats);
                repeats.map_err(|e| format!("harvest: repeats: {e}"))?;
                let horizon = horizon.with_value(extent.horizon_s / horizon.unit().to_si());
                horizon.map_err(|e| format!("harvest: horizon_s: {e}"))?;
                trees(extent.trees)
            }
            Self::Detect { trees: extent }
            | Self::ReachAndGrasp { trees: extent, .. }
            | Self::Gentle { trees: extent, .. } => trees(extent.trees),
            Self::Scaling { .. } => Ok(()),
        }
    }
}

/// A task's plan with its scenario, and the code and the part of the work that the folder holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlannedTask {
    /// [`CODE_VERSION`].
    pub code_version: String,
    /// The part of the run that this folder holds.
    pub shard: Shard,
    /// The plan.
    pub plan: TaskPlan,
    /// Hash of the scenario, which [`PlanFile::scenarios`] holds.
    pub scenario: String,
}

/// `plan.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanFile {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// The last plan of each task, by its name.
    pub tasks: BTreeMap<String, PlannedTask>,
    /// The scenarios of these tasks, with all their figures, by hash.
    pub scenarios: BTreeMap<String, StoredScenario>,
}

/// The field that every version of a plan has; other fields take no memory.
#[derive(Deserialize)]
struct Head {
    schema_version: Option<serde_json::Value>,
}

/// A `plan.json` that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {problem}")]
pub struct PlanFileError {
    file: String,
    problem: String,
}

impl PlanFile {
    /// File under the result folder.
    pub const FILE: &'static str = "plan.json";

    /// Reads the plan of a folder.
    ///
    /// # Errors
    /// The file is missing, cannot be parsed, or has another schema.
    pub fn read(store: &Store) -> Result<Self, PlanFileError> {
        let path = store.path().join(Self::FILE);
        let bad = |problem: String| PlanFileError { file: path.display().to_string(), problem };
        let bytes = orchard_input::bytes(&path, orchard_input::RESULT);
        let bytes = bytes.map_err(|e| bad(format!("{e}; a result folder of bench-v1 is needed")))?;
        Self::from_bytes(&bytes).map_err(bad)
    }

    /// Reads the bytes of a file.
    ///
    /// # Errors
    /// The file is not as this code writes it, or has another schema.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let no_plan = |e: serde_json::Error| format!("not a plan of bench-v1: {e}");
        let found = serde_json::from_slice::<Head>(bytes).map_err(no_plan)?.schema_version;
        if found != Some(serde_json::json!(SCHEMA_VERSION)) {
            let found = found.map_or_else(|| "none".to_owned(), |found| found.to_string());
            return Err(format!("schema_version {found}, but this code reads {SCHEMA_VERSION}"));
        }
        let content = checked(bytes).map_err(|damage| damage.to_string())?;
        serde_json::from_slice(&content).map_err(no_plan)
    }

    /// Writes plans of a scenario into a folder's file and keeps those of other tasks.
    ///
    /// # Errors
    /// The file cannot be written, or the existing one does not match its checksum.
    pub fn write(
        store: &Store,
        plans: &[TaskPlan],
        scenario: &StoredScenario,
        shard: Shard,
    ) -> Result<(), StoreError> {
        // An edited file may hold plans of other tasks, which would be lost.
        if let Err(e) = store.read(Self::FILE)
            && e.damage() == Some(Damage::WrongChecksum)
        {
            let advice = "does not match its checksum: delete it or choose another folder";
            return Err(StoreError::new(&store.path().join(Self::FILE), io::Error::other(advice)));
        }
        // An unreadable file is of another code version. It is replaced, since each record has its own key.
        let (mut tasks, mut scenarios) =
            Self::read(store).map(|file| (file.tasks, file.scenarios)).unwrap_or_default();
        scenarios.insert(scenario.hash.clone(), scenario.clone());
        for plan in plans {
            let (code_version, scenario) = (CODE_VERSION.to_owned(), scenario.hash.clone());
            let planned = PlannedTask { code_version, shard, plan: plan.clone(), scenario };
            tasks.insert(plan.task().to_owned(), planned);
        }
        scenarios.retain(|hash, _| tasks.values().any(|task| task.scenario == *hash));
        store.write(Self::FILE, &Self { schema_version: SCHEMA_VERSION, tasks, scenarios })
    }

    /// Reads the scenario of a task of a folder.
    ///
    /// # Errors
    /// As [`PlanFile::read`], or the task is not in the folder's plan.
    pub fn scenario_of(store: &Store, task: &str) -> Result<StoredScenario, PlanFileError> {
        let file = Self::read(store)?;
        file.scenario(task).cloned().ok_or_else(|| PlanFileError {
            file: store.path().join(Self::FILE).display().to_string(),
            problem: format!("has no plan of task {task}"),
        })
    }

    /// The scenario of a task, if there is such a task.
    pub fn scenario(&self, task: &str) -> Option<&StoredScenario> {
        self.tasks.get(task).and_then(|planned| self.scenarios.get(&planned.scenario))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_scenario::Scenario;

    fn plans() -> Vec<TaskPlan> {
        let trees = || TreeExtent { profile: "quick".into(), seeds: vec![7, 8], trees: 2 };
        let extent = Extent {
            profile: "quick".into(),
            conditions: vec!["nominal".into(), "fruit".into()],
            seeds: vec![7],
            trees: 1,
            repeats: 1,
            horizon_s: 0.1,
        };
        vec![
            TaskPlan::Harvest { extent, backend: Backend::Cpu },
            TaskPlan::Detect { trees: trees() },
            TaskPlan::Gentle { trees: trees(), backend: Backend::Gpu },
            TaskPlan::Scaling { profile: "full".into(), backend: Backend::Gpu },
        ]
    }

    #[test]
    fn plans_and_scenarios_come_back_as_they_were() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let shard: Shard = "2/3".parse().unwrap();
        let plans = plans();
        let of = |options: &[(&str, &str)]| Scenario::of(options).unwrap();
        let [stereo, trellis] = [of(&[("camera", "d435i")]), of(&[("preset", "v-trellis")])];
        PlanFile::write(&store, &plans[..2], &stereo.stored(), shard).unwrap();
        // A later task leaves the earlier ones in place.
        PlanFile::write(&store, &plans[2..], &trellis.stored(), Shard::WHOLE).unwrap();
        let file = PlanFile::read(&store).unwrap();
        assert_eq!(file.tasks.keys().collect::<Vec<_>>(), ["detect", "gentle", "harvest", "scaling"]);
        for plan in plans {
            let planned = &file.tasks[plan.task()];
            let early = matches!(plan, TaskPlan::Harvest { .. } | TaskPlan::Detect { .. });
            assert_eq!(planned.shard.is_whole(), !early);
            assert_eq!(planned.plan, plan);
            let stored = file.scenario(plan.task()).unwrap();
            let scenario = Scenario::from_stored(stored, &orchard_scenario::controllers(), "x");
            assert_eq!(scenario.unwrap(), if early { stereo.clone() } else { trellis.clone() });
        }
        let e = PlanFile::scenario_of(&store, "reach-and-grasp").unwrap_err().to_string();
        assert!(e.ends_with("plan.json: has no plan of task reach-and-grasp"), "{e}");
    }

    #[test]
    fn numbers_of_a_file_have_the_ranges_of_the_command_line() {
        let protocol = Protocol::paper();
        assert!(plans().iter().all(|plan| plan.check(&protocol).is_ok()));
        let harvest = |change: fn(&mut Extent)| match plans().swap_remove(0) {
            TaskPlan::Harvest { mut extent, backend } => {
                change(&mut extent);
                TaskPlan::Harvest { extent, backend }.check(&protocol).unwrap_err()
            }
            other => panic!("{other:?}"),
        };
        let e = harvest(|extent| extent.repeats = 4_000_000_000);
        assert!(e.starts_with("harvest: repeats: 4000000000 is outside"), "{e}");
        assert!(harvest(|extent| extent.trees = u32::MAX).starts_with("harvest: trees: "));
        assert!(harvest(|extent| extent.horizon_s = 1e9).starts_with("harvest: horizon_s: "));
        let trees = TreeExtent { profile: "quick".into(), seeds: vec![7], trees: u32::MAX };
        let e = TaskPlan::Gentle { trees, backend: Backend::Cpu }.check(&protocol).unwrap_err();
        assert!(e.starts_with("gentle: trees: "), "{e}");
    }

    #[test]
    fn what_is_no_plan_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let e = PlanFile::read(&store).unwrap_err().to_string();
        assert!(e.contains("plan.json: ") && e.ends_with("a result folder of bench-v1 is needed"), "{e}");
        for (text, problem) in [
            ("", "not a plan of bench-v1"),
            ("{}", "schema_version none"),
            ("{\"schema_version\": 1}", "schema_version 1, but this code reads"),
            ("{\"schema_version\": 6, \"tasks\": 5}", "has no checksum"),
        ] {
            std::fs::write(folder.path().join(PlanFile::FILE), text).unwrap();
            let e = PlanFile::read(&store).unwrap_err().to_string();
            assert!(e.contains(problem), "{text}: {e}");
        }
    }

    #[test]
    fn an_edited_plan_is_neither_read_nor_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let scenario = Scenario::of(&[]).unwrap().stored();
        PlanFile::write(&store, &plans(), &scenario, Shard::WHOLE).unwrap();
        let path = folder.path().join(PlanFile::FILE);
        let edited = std::fs::read_to_string(&path).unwrap().replace("\"trees\": 2", "\"trees\": 3");
        std::fs::write(&path, &edited).unwrap();
        let e = PlanFile::read(&store).unwrap_err().to_string();
        assert!(e.contains("plan.json: does not match its checksum"), "{e}");
        let e = PlanFile::write(&store, &plans()[..1], &scenario, Shard::WHOLE).unwrap_err().to_string();
        assert!(e.ends_with("does not match its checksum: delete it or choose another folder"), "{e}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), edited);
    }
}
