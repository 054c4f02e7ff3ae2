//! Plan of a run of the detection task.

use orchard_bench::digest::{config_hash, config_text};
use orchard_bench::{CODE_VERSION, SCHEMA_VERSION};
use orchard_bench::{PlanError, check_trees};
use orchard_perception::DetectorConfig;
use orchard_quantity::ConfigError;
use orchard_scenario::{Scenario, SceneNames};
use orchard_spec::camera::CameraSpec;
use orchard_spec::light::LightSpec;
use serde::{Deserialize, Serialize};

use crate::detect::ablation::variants;
use crate::protocol::Protocol;

/// Every tree of every seed, seen by one camera and one detector.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectPlan {
    /// Names of the trees, the camera and the detector.
    pub scene: SceneNames,
    /// [`orchard_scenario::Scenario::scene_hash`].
    pub scene_hash: String,
    /// Profile that set the defaults of the run.
    pub profile: String,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Trees per seed.
    pub trees: u32,
    /// The camera.
    pub camera: CameraSpec,
    /// Light of colour images; `None` for a clear day.
    pub light: Option<LightSpec>,
    /// The detector.
    pub detector: DetectorConfig,
    /// Protocol constants.
    pub protocol: Protocol,
}

/// Key of a tree's record: all inputs that determine it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DetectKey {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// [`CODE_VERSION`].
    pub code_version: String,
    /// SHA-256 over scene and protocol, hexadecimal.
    pub config_hash: String,
    /// Names of the trees, the camera and the detector.
    #[serde(flatten)]
    pub scene: SceneNames,
    /// Seed.
    pub seed: u64,
    /// World index under the seed.
    pub world: u32,
    /// True if the gate ablation is run on this tree.
    pub ablation: bool,
}

impl DetectPlan {
    /// Trees `0..trees` of each seed of a scenario, seen by its camera and its detector.
    ///
    /// # Errors
    /// The protocol does not have the scenario's rules.
    pub fn new(scenario: &Scenario, profile: &str, seeds: Vec<u64>, trees: u32) -> Result<Self, ConfigError> {
        Ok(Self {
            scene: scenario.names().scene.clone(),
            scene_hash: scenario.scene_hash(),
            profile: profile.to_owned(),
            seeds,
            trees,
            camera: scenario.spec().camera.clone(),
            light: scenario.spec().light.clone(),
            detector: scenario.detector().clone(),
            protocol: Protocol::of_scenario(scenario)?,
        })
    }

    /// Checks the user's input.
    ///
    /// # Errors
    /// No seed, a seed given twice, no tree.
    pub fn check(&self) -> Result<(), PlanError> {
        check_trees(&self.seeds, self.trees)
    }

    /// SHA-256 over all inputs of a result except the code.
    pub fn config_hash(&self) -> String {
        config_hash(&[("scene", &self.scene_hash), ("protocol", &config_text(&self.protocol))])
    }

    /// Number of detector runs for the record of a key: images times detectors.
    pub fn steps(&self, key: &DetectKey) -> u64 {
        let rules = &self.protocol.detect;
        let ablation = if key.ablation { variants(&self.detector).len() } else { 0 };
        (self.protocol.densities().len() + ablation) as u64 * u64::from(rules.views.get())
    }

    /// The keys of all trees, seed by seed. The ablation is run on those of the first seed.
    pub fn keys(&self) -> Vec<DetectKey> {
        let config_hash = self.config_hash();
        let key = |seed, world| DetectKey {
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            config_hash: config_hash.clone(),
            scene: self.scene.clone(),
            seed,
            world,
            ablation: self.seeds.first() == Some(&seed),
        };
        let worlds = |&seed: &u64| (0..self.trees).map(move |world| (seed, world));
        self.seeds.iter().flat_map(worlds).map(|(seed, world)| key(seed, world)).collect()
    }
}
