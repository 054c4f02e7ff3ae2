//! The worlds and controllers of a scenario, under every condition of the matrix.

use orchard_bench::digest::{config_hash, config_text};
use orchard_picker::Controller;
use orchard_quantity::ConfigError;
use orchard_scenario::Scenario;
use orchard_world::World;

use crate::backend::Backend;
use crate::harvest::adapter::Recorded;
use crate::harvest::episode::EpisodeKey;
use crate::harvest::matrix::{ConditionError, Dials, Matrix, MatrixCondition, NOMINAL, is_exhaustion};
use crate::harvest::plan::{Condition, ConditionParams, Extent, Plan};
use crate::harvest::run::WorldFactory;
use crate::protocol::Protocol;

/// Makes the worlds of every condition of the matrix.
#[derive(Debug, Clone)]
pub struct Harvest {
    scenario: Scenario,
    protocol: Protocol,
    matrix: Matrix,
}

impl Harvest {
    /// Makes the matrix with a scenario's own worlds as nominal; on preset `paper`: 40 fruit, foliage 0.6 and flat ground.
    ///
    /// # Errors
    /// The protocol does not have the scenario's rules, or the scenario lacks the figure of a sweep.
    pub fn new(scenario: Scenario) -> Result<Self, ConfigError> {
        let protocol = Protocol::of_scenario(&scenario)?;
        let matrix = Matrix::of(protocol.matrix_rules(), &scenario).map_err(|e| ConfigError {
            file: protocol.version.clone(),
            field: "conditions".to_owned(),
            problem: e.to_string(),
        })?;
        Ok(Self { matrix, scenario, protocol })
    }

    /// The scenario.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The protocol.
    pub fn protocol(&self) -> &Protocol {
        &self.protocol
    }

    /// All conditions, sweeps and groups.
    pub fn matrix(&self) -> &Matrix {
        &self.matrix
    }

    /// The nominal condition on trees `0..trees` of each seed, for `horizon` seconds each.
    ///
    /// # Panics
    /// Never: the nominal condition is in every matrix.
    pub fn plan(&self, profile: &str, seeds: Vec<u64>, trees: u32, horizon: f64) -> Plan {
        let conditions = vec![NOMINAL.to_owned()];
        let profile = profile.to_owned();
        let extent = Extent { profile, conditions, seeds, trees, repeats: 1, horizon_s: horizon };
        self.plan_of(extent).unwrap_or_else(|e| unreachable!("{e}"))
    }

    /// A part of the matrix. All conditions have the same trees, and the start poses of the first repeat.
    ///
    /// # Errors
    /// A name that is neither a condition nor a sweep; a condition whose worlds the config does not allow.
    pub fn plan_of(&self, extent: Extent) -> Result<Plan, ConditionError> {
        let chosen = self.matrix.choose(&extent.conditions)?;
        let names: Vec<&str> = chosen.iter().map(|condition| condition.name.as_str()).collect();
        let condition = |condition: &&MatrixCondition| -> Result<Condition, ConditionError> {
            let changed = condition.of(&self.scenario)?;
            let params = ConditionParams {
                dials: Dials::of(changed.spec()),
                trees: extent.trees,
                horizon_s: match &*condition.name {
                    name if is_exhaustion(name) => self.protocol.exhaustion.horizon.si(),
                    _ => extent.horizon_s,
                },
                repeats: if condition.name == NOMINAL { extent.repeats } else { 1 },
            };
            Ok(Condition { name: condition.name.clone(), params })
        };
        Ok(Plan {
            scenario: self.scenario.names().clone(),
            scenario_hash: self.scenario.hash(),
            profile: extent.profile,
            sweeps: self.matrix.sweeps_of(&names),
            conditions: chosen.iter().map(condition).collect::<Result<_, _>>()?,
            seed_set: self.protocol.label(&extent.seeds, extent.trees),
            seeds: extent.seeds,
            frame: self.frame(),
            config_hash: self.config_hash(),
            protocol: self.protocol.clone(),
            backend: Backend::Cpu,
        })
    }

    /// The scenario of a condition.
    ///
    /// # Errors
    /// No such condition, or a change that the scenario does not allow.
    pub fn scenario_of(&self, condition: &str) -> Result<Scenario, ConditionError> {
        let found = self.matrix.condition(condition);
        found.ok_or_else(|| ConditionError::None(condition.to_owned()))?.of(&self.scenario)
    }

    /// Length of a frame \[s\].
    pub fn frame(&self) -> f64 {
        self.scenario.spec().sim.frame()
    }

    /// Hash of the whole configuration of an episode.
    pub fn config_hash(&self) -> String {
        config_hash(&[("scenario", &self.scenario.hash()), ("protocol", &config_text(&self.protocol))])
    }
}

impl WorldFactory for Harvest {
    type World = World;
    type Controller = Recorded<Box<dyn Controller>>;

    fn build(&self, key: &EpisodeKey) -> Result<(World, Self::Controller), String> {
        let scenario = self.scenario_of(&key.condition).map_err(|e| e.to_string())?;
        let world = scenario.world(key.seed, key.world, key.repeat).map_err(|e| e.to_string())?;
        Ok((world, Recorded::new(scenario.controller())))
    }
}
