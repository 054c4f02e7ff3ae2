//! What a run of a component task consists of.

use std::sync::Arc;

use orchard_perception::DetectorConfig;
use orchard_picker::{GOAL_TOML, Kind};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use serde::{Deserialize, Serialize};

use super::Component;
use crate::episode::{CODE_VERSION, SCHEMA_VERSION};
use crate::plan::{PlanError, check_trees, config_hash, config_text};
use crate::protocol::{PAPER_TOML, Protocol};

/// Every tree of every seed under one controller.
#[derive(Debug, Clone)]
pub struct ComponentPlan {
    /// The worlds.
    pub spec: Arc<Spec>,
    /// The robot.
    pub robot: Arc<RobotModel>,
    /// The detector of the controller.
    pub detector: DetectorConfig,
    /// The controller.
    pub controller: Kind,
    /// Profile whose defaults the run took.
    pub profile: String,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Trees a seed.
    pub trees: u32,
    /// Protocol constants.
    pub protocol: Protocol,
}

/// What all trees of a run have in common.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ComponentRun {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// [`CODE_VERSION`].
    pub code_version: String,
    /// SHA-256 of all config texts, hexadecimal.
    pub config_hash: String,
    /// Preset of the trees.
    pub preset: String,
    /// The task.
    pub task: String,
    /// The controller.
    pub controller: String,
}

/// What the record of a tree is a function of.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ComponentKey {
    /// The run.
    #[serde(flatten)]
    pub run: ComponentRun,
    /// Seed.
    pub seed: u64,
    /// World index under the seed.
    pub world: u32,
}

impl ComponentPlan {
    /// The preset `paper` under a controller.
    pub fn paper(controller: Kind, profile: &str, seeds: Vec<u64>, trees: u32) -> Self {
        Self {
            spec: Arc::new(Spec::paper()),
            robot: Arc::new(RobotModel::paper()),
            detector: DetectorConfig::paper(),
            controller,
            profile: profile.to_owned(),
            seeds,
            trees,
            protocol: Protocol::paper(),
        }
    }

    /// Checks what a user can get wrong.
    ///
    /// # Errors
    /// No seed, a seed given twice, no tree.
    pub fn check(&self) -> Result<(), PlanError> {
        check_trees(&self.seeds, self.trees)
    }

    /// Frames of a tree's trials at most.
    pub fn steps<C: Component>(&self) -> u64 {
        let rules = &self.protocol.component;
        u64::from(C::trials(rules)) * (C::time(rules) / self.spec.sim.frame()).round() as u64
    }

    /// SHA-256 over everything that a result depends on besides the code.
    pub fn config_hash(&self) -> String {
        let (spec, protocol) = (config_text(&*self.spec), config_text(&self.protocol));
        let texts = [
            ("world", &*spec),
            ("protocol", &*protocol),
            ("robot.toml", orchard_robot::PAPER_TOML),
            ("robot.urdf", orchard_robot::PAPER_URDF),
            ("perception.toml", orchard_perception::config::PAPER_TOML),
            ("v1.toml", PAPER_TOML),
            ("picker.toml", orchard_picker::BASELINE_TOML),
            ("controller.toml", self.controller.toml()),
            ("goal.toml", GOAL_TOML),
        ];
        config_hash(&texts)
    }

    /// What all trees of a task have in common.
    pub fn run_of(&self, task: &str) -> ComponentRun {
        ComponentRun {
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            config_hash: self.config_hash(),
            preset: self.spec.preset.clone(),
            task: task.to_owned(),
            controller: self.controller.name().to_owned(),
        }
    }

    /// The keys of all trees of a task, seed by seed.
    pub fn keys(&self, task: &str) -> Vec<ComponentKey> {
        let run = self.run_of(task);
        let worlds = |&seed: &u64| (0..self.trees).map(move |world| (seed, world));
        let key = |(seed, world)| ComponentKey { run: run.clone(), seed, world };
        self.seeds.iter().flat_map(worlds).map(key).collect()
    }
}
