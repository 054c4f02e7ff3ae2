//! `meta.json`: everything that the files of a folder mean.

use std::path::Path;
use std::sync::Arc;

use orchard_bench::CODE_VERSION;
use orchard_bench::checksum::checked;
use orchard_env::{Settings, Task, Via};
use orchard_picker::ControllerKind;
use orchard_policy::{Spaces, Target};
use orchard_scenario::{Scenario, StoredScenario};
use orchard_tasks::plan_file::Backend;
use serde::{Deserialize, Serialize};

use crate::config::DemosRules;
use crate::person::person;
use crate::plan::{DemosError, Plan, SCHEMA_VERSION};

/// Content of `meta.json`, written first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Meta {
    /// `orchard-demos`.
    pub format: String,
    /// Version of the layout.
    pub schema_version: u32,
    /// Version of the code.
    pub code_version: String,
    /// The task.
    pub task: Task,
    /// The task in words.
    pub task_description: String,
    /// The way of the controller's commands to the robot.
    pub via: Via,
    /// Processor that moved the worlds: the CPU in f64, or a graphics device in f32.
    #[serde(default, skip_serializing_if = "Backend::is_cpu")]
    pub backend: Backend,
    /// Seeds.
    pub seeds: Vec<u64>,
    /// Number of episodes.
    pub episodes: u32,
    /// Actions a second \[Hz\].
    pub control_hz: u32,
    /// Depth of value 1 in the depth images \[m\].
    pub depth_unit_m: f64,
    /// SHA-256 of the scenario.
    pub scenario_hash: String,
    /// Figures of images and splits.
    pub rules: DemosRules,
    /// Settings that the policy asks for.
    pub spaces: Spaces,
    /// All conventions: names, units, signs and ranges of observations, actions and rewards.
    pub interface: serde_json::Value,
    /// The scenario with all its figures.
    pub scenario: Box<StoredScenario>,
}

/// A folder whose `meta.json` cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MetaError {
    /// The file cannot be read, or is damaged.
    #[error("{path}: {problem}")]
    File {
        /// File.
        path: String,
        /// Problem.
        problem: String,
    },
    /// This code cannot plan such demonstrations.
    #[error(transparent)]
    Plan(#[from] DemosError),
}

const FORMAT: &str = "orchard-demos";

impl Meta {
    /// File under the folder.
    pub const FILE: &'static str = "meta.json";

    /// Meaning of a plan's files.
    pub fn of(plan: &Plan) -> Self {
        let task = plan.settings.task;
        Self {
            format: FORMAT.to_owned(),
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            task,
            task_description: Target::sentence(task.target()).to_owned(),
            via: plan.via,
            backend: plan.settings.backend,
            seeds: plan.seeds.clone(),
            episodes: plan.episodes,
            control_hz: plan.settings.spaces.control_hz,
            depth_unit_m: plan.rules.depth_unit.si(),
            scenario_hash: plan.scenario.hash(),
            rules: plan.rules.clone(),
            spaces: plan.settings.spaces.clone(),
            interface: plan.interface.clone(),
            scenario: Box::new(plan.scenario.stored()),
        }
    }

    /// Reads the file of a folder.
    ///
    /// # Errors
    /// There is none, or it is damaged.
    pub fn read(root: &Path) -> Result<Self, MetaError> {
        let path = root.join(Self::FILE);
        let bad = |problem: String| MetaError::File { path: path.display().to_string(), problem };
        let bytes = orchard_input::bytes(&path, orchard_input::RESULT).map_err(|e| bad(e.to_string()))?;
        let content = checked(&bytes).map_err(|e| bad(e.to_string()))?;
        serde_json::from_slice(&content).map_err(|e| bad(e.to_string()))
    }

    /// The plan of the folder's files, with this program's controllers; `by` names the folder in errors.
    ///
    /// # Errors
    /// The files are of another code version, or the scenario cannot be used.
    pub fn plan(&self, controllers: &[Arc<dyn ControllerKind>], by: &str) -> Result<Plan, MetaError> {
        let bad = |problem: String| MetaError::File { path: format!("{by}/{}", Self::FILE), problem };
        let here = (FORMAT, SCHEMA_VERSION, CODE_VERSION);
        if (self.format.as_str(), self.schema_version, self.code_version.as_str()) != here {
            return Err(bad(format!(
                "holds {} of schema {} and code version {}; this program verifies {} of schema {} and code version {}",
                self.format, self.schema_version, self.code_version, here.0, here.1, here.2
            )));
        }
        let mut controllers = controllers.to_vec();
        controllers.push(Arc::new(person()));
        let scenario =
            Scenario::from_stored(&self.scenario, &controllers, by).map_err(|e| bad(e.to_string()))?;
        let (spaces, backend) = (self.spaces.clone(), self.backend);
        let settings = Settings { spaces, backend, ..Settings::of(self.task) };
        Ok(Plan::new(scenario, settings, self.via, self.seeds.clone(), self.episodes)?)
    }
}
