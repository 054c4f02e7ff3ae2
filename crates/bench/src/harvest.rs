//! The benchmark's own worlds: the preset's trees and robot, harvested by one of the project's controllers.

use std::sync::Arc;

use orchard_perception::DetectorConfig;
use orchard_picker::{Controller, Kind};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_world::World;
use serde::{Deserialize, Serialize};

use crate::adapter::Recorded;
use crate::episode::EpisodeKey;
use crate::matrix::{EXHAUSTION, Matrix, MatrixCondition, NOMINAL, UnknownCondition};
use crate::plan::{Condition, ConditionParams, Plan, config_hash};
use crate::protocol::Protocol;
use crate::run::WorldFactory;

/// Makes the worlds of every condition of the matrix.
#[derive(Debug, Clone)]
pub struct Harvest {
    spec: Arc<Spec>,
    robot: Arc<RobotModel>,
    detector: DetectorConfig,
    controller: Kind,
    protocol: Protocol,
    matrix: Matrix,
}

/// How much of the matrix is run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Extent {
    /// Profile whose defaults these are.
    pub profile: String,
    /// Names of conditions and sweeps.
    pub conditions: Vec<String>,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Trees a seed.
    pub trees: u32,
    /// Episodes a tree under the nominal condition.
    pub repeats: u32,
    /// Length of an episode [s], but under `exhaustion`.
    pub horizon_s: f64,
}

impl Harvest {
    /// The preset `paper` under a controller: 40 fruit, foliage 0.6, flat ground, and what sweeps make of it.
    pub fn paper(controller: Kind) -> Self {
        let (spec, protocol) = (Spec::paper(), Protocol::paper());
        Self {
            matrix: Matrix::of(&protocol, &spec),
            spec: Arc::new(spec),
            robot: Arc::new(RobotModel::paper()),
            detector: DetectorConfig::paper(),
            controller,
            protocol,
        }
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
    /// A name that is neither a condition nor a sweep.
    pub fn plan_of(&self, extent: Extent) -> Result<Plan, UnknownCondition> {
        let chosen = self.matrix.choose(&extent.conditions)?;
        let names: Vec<&str> = chosen.iter().map(|condition| condition.name.as_str()).collect();
        let condition = |condition: &&MatrixCondition| Condition {
            name: condition.name.clone(),
            params: ConditionParams {
                dials: condition.dials,
                trees: extent.trees,
                horizon_s: match &*condition.name {
                    EXHAUSTION => self.protocol.exhaustion.horizon.si(),
                    _ => extent.horizon_s,
                },
                repeats: if condition.name == NOMINAL { extent.repeats } else { 1 },
            },
        };
        Ok(Plan {
            preset: self.spec.preset.clone(),
            profile: extent.profile,
            controller: self.controller.name().to_owned(),
            sweeps: self.matrix.sweeps_of(&names),
            conditions: chosen.iter().map(condition).collect(),
            seed_set: self.protocol.label(&extent.seeds, extent.trees),
            seeds: extent.seeds,
            frame: self.frame(),
            config_hash: self.config_hash(),
            protocol: self.protocol.clone(),
        })
    }

    /// Length of a frame [s].
    pub fn frame(&self) -> f64 {
        self.spec.sim.frame()
    }

    /// Hash of all that an episode is configured by.
    pub fn config_hash(&self) -> String {
        config_hash(&[
            ("world.toml", orchard_spec::Preset::Paper.toml()),
            ("camera.toml", orchard_spec::camera::PAPER_TOML),
            ("robot.toml", orchard_robot::PAPER_TOML),
            ("robot.urdf", orchard_robot::PAPER_URDF),
            ("perception.toml", orchard_perception::config::PAPER_TOML),
            ("picker.toml", self.controller.toml()),
            ("v1.toml", crate::protocol::PAPER_TOML),
        ])
    }
}

impl WorldFactory for Harvest {
    type World = World;
    type Controller = Recorded<Box<dyn Controller>>;

    fn build(&self, key: &EpisodeKey) -> Result<(World, Self::Controller), String> {
        let condition = self.matrix.condition(&key.condition);
        let dials = condition.ok_or_else(|| format!("there is no condition {}", key.condition))?.dials;
        let spec = Arc::new(dials.turn(&self.spec)?);
        let world = World::of_repeat(spec, self.robot.clone(), key.seed, key.world, key.repeat)
            .map_err(|e| e.to_string())?;
        let controller = self.controller.controller(&self.robot, self.detector.clone());
        Ok((world, Recorded::new(controller)))
    }
}
