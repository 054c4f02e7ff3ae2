//! Plan of a run of a component task.

use orchard_bench::digest::{config_hash, config_text};
use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_bench::{PlanError, check_trees};
use orchard_quantity::ConfigError;
use orchard_scenario::{Names, Scenario};
use serde::{Deserialize, Serialize};

use crate::backend::Backend;
use crate::component::task::Component;
use crate::protocol::Protocol;

/// Every tree of every seed under one controller.
#[derive(Debug, Clone)]
pub struct ComponentPlan {
    /// Worlds, robot and controller.
    pub scenario: Scenario,
    /// Profile that set the defaults of the run.
    pub profile: String,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Trees per seed.
    pub trees: u32,
    /// Protocol constants.
    pub protocol: Protocol,
    /// Backend that moves the worlds.
    pub backend: Backend,
}

/// Common part of the keys of a run's trees.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ComponentRun {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// [`CODE_VERSION`].
    pub code_version: String,
    /// SHA-256 over scenario and protocol, hexadecimal.
    pub config_hash: String,
    /// Names of world, robot, camera, detector and controller.
    #[serde(flatten)]
    pub scenario: Names,
    /// The task.
    pub task: String,
    /// Backend that moved the worlds.
    #[serde(default, skip_serializing_if = "Backend::is_cpu")]
    pub backend: Backend,
}

/// Key of a tree's record: all inputs that determine it.
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
    /// Trees `0..trees` of each seed of a scenario.
    ///
    /// # Errors
    /// The protocol does not have the scenario's rules.
    pub fn new(scenario: Scenario, profile: &str, seeds: Vec<u64>, trees: u32) -> Result<Self, ConfigError> {
        let protocol = Protocol::of_scenario(&scenario)?;
        let backend = Backend::Cpu;
        Ok(Self { scenario, profile: profile.to_owned(), seeds, trees, protocol, backend })
    }

    /// Checks the user's input.
    ///
    /// # Errors
    /// No seed, a seed given twice, no tree, or a controller that cannot be given a goal.
    pub fn check(&self) -> Result<(), PlanError> {
        if !self.scenario.controller_kind().takes_goals() {
            return Err(PlanError::NoGoals(self.scenario.names().controller.clone()));
        }
        check_trees(&self.seeds, self.trees)
    }

    /// Largest number of frames of a tree's trials.
    pub fn steps<C: Component>(&self) -> u64 {
        let rules = &self.protocol.component;
        u64::from(C::trials(rules)) * (C::time(rules) / self.scenario.spec().sim.frame()).round() as u64
    }

    /// SHA-256 over all inputs of a result except the code.
    pub fn config_hash(&self) -> String {
        config_hash(&[("scenario", &self.scenario.hash()), ("protocol", &config_text(&self.protocol))])
    }

    /// Returns the common part of the keys of a task's trees.
    pub fn run_of(&self, task: &str) -> ComponentRun {
        ComponentRun {
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            config_hash: self.config_hash(),
            scenario: self.scenario.names().clone(),
            task: task.to_owned(),
            backend: self.backend,
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
