//! Scenarios stored in results, so that a result can be run again without its option files.

use std::sync::Arc;

use orchard_perception::DetectorConfig;
use orchard_picker::ControllerKind;
use orchard_spec::Spec;
use serde::{Deserialize, Serialize};

use crate::figures::Layers;
use crate::limits;
use crate::resolve::{find_controller, find_robot};
use crate::{Names, OptionValue, Scenario, ScenarioError, TreeFile};

/// A scenario with all its figures. Robot and controller come with a program and are kept by name; the controller's config texts stand
/// beside its name, so that a program without it can still check the hash.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredScenario {
    /// Names of all parts.
    #[serde(flatten)]
    pub names: Names,
    /// [`Scenario::hash`].
    pub hash: String,
    /// The world.
    pub world: Box<Spec>,
    /// The digitised tree, if there is one.
    pub tree_file: Option<TreeFile>,
    /// The detector's config.
    pub detector_config: Box<DetectorConfig>,
    /// Config texts of the controller, by name.
    pub controller_configs: Vec<(String, String)>,
    /// Figures of the tasks that differ from the protocol's.
    pub rules: toml::Table,
}

impl Scenario {
    /// Returns the stored form of the scenario.
    pub fn stored(&self) -> StoredScenario {
        StoredScenario {
            names: self.names.clone(),
            hash: self.hash(),
            world: Box::new((*self.spec).clone()),
            tree_file: self.tree.as_deref().cloned(),
            detector_config: Box::new(self.detector.clone()),
            controller_configs: self.controller.configs(),
            rules: self.rules.clone(),
        }
    }

    /// Restores a stored scenario with this program's robots and controllers. `by` names the result in errors.
    ///
    /// # Errors
    /// A robot or controller that this program does not have, or figures that do not match the hash.
    pub fn from_stored(
        stored: &StoredScenario,
        controllers: &[Arc<dyn ControllerKind>],
        by: &str,
    ) -> Result<Self, ScenarioError> {
        let names = stored.names.clone();
        let too_large =
            limits::of_world(&stored.world).or_else(|| limits::of_detector(&stored.detector_config));
        if let Some((field, problem)) = too_large {
            return Err(ScenarioError::new(format!("{by}: {field}"), problem));
        }
        let given = |field: &str, value: &str| OptionValue::new(value, format!("{by}: {field}"));
        let scenario = Self {
            robot: find_robot(&given("robot", &names.scene.robot))?,
            controller: find_controller(&given("controller", &names.controller), controllers)?,
            spec: Arc::new((*stored.world).clone()),
            tree: stored.tree_file.clone().map(Arc::new),
            detector: (*stored.detector_config).clone(),
            rules: stored.rules.clone(),
            layers: Layers::of_one(by, &stored.world),
            names,
        };
        let hash = scenario.hash();
        if hash == stored.hash {
            return Ok(scenario);
        }
        Err(ScenarioError::new(
            by,
            format!(
                "the stored hash {} differs from that of its figures in this program, {hash}",
                stored.hash
            ),
        ))
    }
}
