//! The benchmark's own worlds: the preset's trees and robot, harvested by one of the project's controllers.

use std::sync::Arc;

use orchard_perception::DetectorConfig;
use orchard_picker::{Controller, Kind};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_world::World;

use crate::adapter::Recorded;
use crate::plan::{Condition, ConditionParams, Plan, config_hash};
use crate::protocol::{ConditionName, Protocol};
use crate::run::WorldFactory;

/// Makes the worlds of the nominal condition and of `exhaustion`, which are the same.
#[derive(Debug, Clone)]
pub struct Harvest {
    spec: Arc<Spec>,
    robot: Arc<RobotModel>,
    detector: DetectorConfig,
    controller: Kind,
}

impl Harvest {
    /// The preset `paper` under a controller: 40 fruit, foliage 0.6, flat ground.
    pub fn paper(controller: Kind) -> Self {
        Self {
            spec: Arc::new(Spec::paper()),
            robot: Arc::new(RobotModel::paper()),
            detector: DetectorConfig::paper(),
            controller,
        }
    }

    /// The nominal condition on trees `0..trees` of each seed, for `horizon` seconds each.
    pub fn plan(&self, profile: &str, seeds: Vec<u64>, trees: u32, horizon: f64) -> Plan {
        self.plan_of(profile, seeds, trees, &[(ConditionName::Nominal, horizon)])
    }

    /// Conditions with their horizons [s] on trees `0..trees` of each seed.
    pub fn plan_of(
        &self,
        profile: &str,
        seeds: Vec<u64>,
        trees: u32,
        conditions: &[(ConditionName, f64)],
    ) -> Plan {
        let spec = &self.spec;
        let condition = |&(name, horizon_s): &(ConditionName, f64)| Condition {
            name: name.name().to_owned(),
            params: ConditionParams {
                fruit_count: spec.fruit.count.get(),
                foliage_density: spec.foliage.density.si(),
                terrain_amplitude_m: if spec.terrain.enabled { spec.terrain.amplitude.si() } else { 0.0 },
                trees,
                horizon_s,
                repeats: 1,
            },
        };
        let protocol = Protocol::paper();
        Plan {
            preset: spec.preset.clone(),
            profile: profile.to_owned(),
            controller: self.controller.name().to_owned(),
            conditions: conditions.iter().map(condition).collect(),
            seed_set: protocol.label(&seeds, trees),
            seeds,
            frame: self.frame(),
            config_hash: self.config_hash(),
            protocol,
        }
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
            ("bench.toml", crate::protocol::PAPER_TOML),
        ])
    }
}

impl WorldFactory for Harvest {
    type World = World;
    type Controller = Recorded<Box<dyn Controller>>;

    fn build(&self, seed: u64, world: u32, repeat: u32) -> Result<(World, Self::Controller), String> {
        let world = World::of_repeat(self.spec.clone(), self.robot.clone(), seed, world, repeat)
            .map_err(|e| e.to_string())?;
        let controller = self.controller.controller(&self.robot, self.detector.clone());
        Ok((world, Recorded::new(controller)))
    }
}
