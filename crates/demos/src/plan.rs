//! Plan of demonstrations: all inputs that determine them.

use orchard_bench::digest::{config_hash, config_text};
use orchard_bench::{CODE_VERSION, MOST_RECORDS, PlanError, check_trees};
use orchard_env::{EnvError, Settings, TaskEnv, Via, WORLDS};
use orchard_policy::Field;
use orchard_scenario::Scenario;
use orchard_tasks::plan_file::Backend;
use orchard_tasks::protocol::Protocol;

use crate::config::DemosRules;
use crate::person::PERSON;
use crate::record::DemoKey;

/// Version of the layout of the files.
pub const SCHEMA_VERSION: u32 = 1;

/// Demonstrations that cannot be planned.
#[derive(Debug, thiserror::Error)]
pub enum DemosError {
    /// Settings that do not fit, or rules that the protocol does not have.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// The protocol does not have the scenario's rules.
    #[error(transparent)]
    Rules(#[from] orchard_quantity::ConfigError),
    /// Seeds that cannot be used, or no episode.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// More episodes than the seeds have worlds, or than a folder holds.
    #[error("--episodes {episodes}: {seeds} seeds give at most {most}")]
    TooMany {
        /// Episodes.
        episodes: u32,
        /// Number of seeds.
        seeds: usize,
        /// Most episodes.
        most: u64,
    },
    /// A seed of the official set.
    #[error(
        "seed {0} is one of the official set v1: a policy that learned from its trees could not be ranked; choose another"
    )]
    Official(u64),
}

/// Episodes of a task under a scenario's controller.
#[derive(Debug, Clone)]
pub struct Plan {
    pub(crate) scenario: Scenario,
    pub(crate) settings: Settings,
    pub(crate) via: Via,
    pub(crate) seeds: Vec<u64>,
    pub(crate) episodes: u32,
    pub(crate) rules: DemosRules,
    /// Conventions of the environment, as JSON.
    pub(crate) interface: serde_json::Value,
    /// The arrays of an observation.
    pub(crate) fields: Vec<Field>,
    /// Longest episode \[frames\], and length of a frame \[s\].
    pub(crate) frames: u64,
    pub(crate) frame: f64,
    /// Frames of a step.
    steps_of: u32,
    config_hash: String,
}

impl Plan {
    /// Plans episodes of a task: episode `i` has seed number `i mod S` of the `S` seeds, and world `i / S` of it. So a larger plan continues
    /// a smaller one.
    ///
    /// # Errors
    /// Settings that do not fit, a controller that takes no goals where the task has one, a seed twice or of the official set, no episode
    /// or more than the seeds have worlds.
    pub fn new(
        scenario: Scenario,
        settings: Settings,
        via: Via,
        seeds: Vec<u64>,
        episodes: u32,
    ) -> Result<Self, DemosError> {
        check_trees(&seeds, episodes.min(1))?;
        let most = MOST_RECORDS.min(seeds.len() as u64 * u64::from(WORLDS));
        if u64::from(episodes) > most {
            return Err(DemosError::TooMany { episodes, seeds: seeds.len(), most });
        }
        let protocol = Protocol::of_scenario(&scenario)?;
        held_out(&seeds)?;
        if settings.task.target().is_some() && !scenario.controller_kind().takes_goals() {
            return Err(PlanError::NoGoals(scenario.names().controller.clone()).into());
        }
        // Its conventions are the same on every backend.
        let env = TaskEnv::new(&scenario, &Settings { backend: Backend::Cpu, ..settings.clone() }, 0..1)?;
        let interface = env.interface();
        let rules = DemosRules::v1();
        let (of_scenario, of_protocol) = (scenario.hash(), config_text(&protocol));
        let (of_interface, of_rules) = (config_text(interface), config_text(&rules));
        let mut inputs = vec![
            ("scenario", &of_scenario[..]),
            ("protocol", &of_protocol),
            ("interface", &of_interface),
            ("demos", &of_rules),
        ];
        if settings.backend != Backend::Cpu {
            inputs.push(("backend", settings.backend.name()));
        }
        let config_hash = config_hash(&inputs);
        let fields = interface.policy.observation.clone();
        let (frame, steps_of) = (interface.policy.frame, interface.policy.frames);
        let frames = (interface.horizon / frame).round() as u64;
        let interface = serde_json::to_value(interface)
            .unwrap_or_else(|e| unreachable!("names and numbers are JSON: {e}"));
        Ok(Self {
            scenario,
            settings,
            via,
            seeds,
            episodes,
            rules,
            interface,
            fields,
            frames,
            frame,
            steps_of,
            config_hash,
        })
    }

    /// Frames of a step.
    pub(crate) fn step_frames(&self) -> u32 {
        self.steps_of
    }

    /// Name of the only condition of demonstrations.
    #[cfg(feature = "gpu")]
    pub(crate) const CONDITION: &str = "demonstrations";

    /// Share of the episodes in the berths of a device: all of them.
    #[cfg(feature = "gpu")]
    pub fn share(&self) -> orchard_lockstep::Share<'_> {
        let (condition, episodes) = (Self::CONDITION, self.episodes as usize);
        orchard_lockstep::Share { condition, scenario: &self.scenario, episodes }
    }

    /// Processor that moves the worlds.
    pub fn backend(&self) -> Backend {
        self.settings.backend
    }

    /// True if a person drove: an episode ends then with what was driven, if the task has not ended before.
    pub(crate) fn is_driven(&self) -> bool {
        self.scenario.names().controller == PERSON
    }

    /// Number of episodes.
    pub fn episodes(&self) -> u32 {
        self.episodes
    }

    /// Frames of the longest episode.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// The keys of all episodes, in order.
    pub fn keys(&self) -> Vec<DemoKey> {
        let count = self.seeds.len() as u32;
        let key = |i: u32| DemoKey {
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            config_hash: self.config_hash.clone(),
            scenario: self.scenario.names().clone(),
            task: self.settings.task,
            via: self.via,
            seed: self.seeds[(i % count) as usize],
            world: i / count,
        };
        (0..self.episodes).map(key).collect()
    }
}

/// Refuses seeds of the official set.
pub(crate) fn held_out(seeds: &[u64]) -> Result<(), DemosError> {
    let official = Protocol::field().held_out_seeds();
    seeds.iter().find(|seed| official.contains(seed)).map_or(Ok(()), |seed| Err(DemosError::Official(*seed)))
}
