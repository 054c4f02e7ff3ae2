//! What a run of the detection task consists of.

use orchard_perception::DetectorConfig;
use orchard_spec::camera::CameraSpec;
use serde::{Deserialize, Serialize};

use super::ablation::variants;
use crate::episode::{CODE_VERSION, SCHEMA_VERSION};
use crate::plan::{PlanError, check_trees, config_hash, config_text};
use crate::protocol::Protocol;

/// Every tree of every seed, seen by one camera and one detector.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectPlan {
    /// Preset of the trees.
    pub preset: String,
    /// Profile whose defaults the run took.
    pub profile: String,
    /// Seeds, in order.
    pub seeds: Vec<u64>,
    /// Trees a seed.
    pub trees: u32,
    /// The camera.
    pub camera: CameraSpec,
    /// Name of the detector's config.
    pub detector_name: String,
    /// The detector.
    pub detector: DetectorConfig,
    /// Protocol constants.
    pub protocol: Protocol,
    /// Other texts that the trees depend on, by name.
    pub texts: Vec<(&'static str, &'static str)>,
}

/// What the record of a tree is a function of.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DetectKey {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// [`CODE_VERSION`].
    pub code_version: String,
    /// SHA-256 of all config texts, hexadecimal.
    pub config_hash: String,
    /// Preset of the trees.
    pub preset: String,
    /// Model of the camera.
    pub camera: String,
    /// Name of the detector's config.
    pub detector: String,
    /// Seed.
    pub seed: u64,
    /// World index under the seed.
    pub world: u32,
    /// Whether the gate ablation is run on this tree.
    pub ablation: bool,
}

impl DetectPlan {
    /// Checks what a user can get wrong.
    ///
    /// # Errors
    /// No seed, a seed given twice, no tree.
    pub fn check(&self) -> Result<(), PlanError> {
        check_trees(&self.seeds, self.trees)
    }

    /// SHA-256 over everything that a result depends on besides the code.
    pub fn config_hash(&self) -> String {
        let (camera, detector, protocol) =
            (config_text(&self.camera), config_text(&self.detector), config_text(&self.protocol));
        let mut texts = vec![("camera", &*camera), ("detector", &*detector), ("protocol", &*protocol)];
        texts.extend(self.texts.iter().copied());
        config_hash(&texts)
    }

    /// Images that are looked at for the record of a key, one by each detector.
    pub fn steps(&self, key: &DetectKey) -> u64 {
        let rules = &self.protocol.detect;
        let ablation = if key.ablation { variants(&self.detector).len() } else { 0 };
        (self.protocol.sweeps.foliage.len() + ablation) as u64 * u64::from(rules.views.get())
    }

    /// The keys of all trees, seed by seed. The ablation is run on those of the first seed.
    pub fn keys(&self) -> Vec<DetectKey> {
        let config_hash = self.config_hash();
        let key = |seed, world| DetectKey {
            schema_version: SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            config_hash: config_hash.clone(),
            preset: self.preset.clone(),
            camera: self.camera.name().to_owned(),
            detector: self.detector_name.clone(),
            seed,
            world,
            ablation: self.seeds.first() == Some(&seed),
        };
        let worlds = |&seed: &u64| (0..self.trees).map(move |world| (seed, world));
        self.seeds.iter().flat_map(worlds).map(|(seed, world)| key(seed, world)).collect()
    }
}
