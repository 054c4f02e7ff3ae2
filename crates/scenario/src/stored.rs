//! Scenarios stored in results, so that a result can be run again without its option files.

use std::collections::BTreeMap;
use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use orchard_perception::DetectorConfig;
use orchard_picker::{ControllerKind, Kind};
use orchard_spec::Spec;
use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer, Serialize};

use crate::figures::Layers;
use crate::limits;
use crate::robot;
use crate::{Names, OptionValue, RobotFiles, Scenario, ScenarioError, TreeFile};

/// A scenario with all its figures. A controller that comes with a program is kept by name, and so is a robot that does; the controller's config texts stand
/// beside its name, so that a program without it can still check the hash. The files of a policy are kept, so that it can be run again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredScenario {
    /// Names of all parts.
    #[serde(flatten)]
    pub names: Names,
    /// [`Scenario::hash`].
    pub hash: String,
    /// The world.
    #[serde(deserialize_with = "config")]
    pub world: Box<Spec>,
    /// The digitised tree, if there is one.
    pub tree_file: Option<TreeFile>,
    /// The robot's files, if it does not come with the program.
    pub robot_files: Option<Box<RobotFiles>>,
    /// The detector's config.
    #[serde(deserialize_with = "config")]
    pub detector_config: Box<DetectorConfig>,
    /// True if nobody named the detector, so that each task takes its own default.
    #[serde(default)]
    pub detector_by_default: bool,
    /// Config texts of the controller, by name.
    pub controller_configs: Vec<(String, String)>,
    /// Files that the controller is made of, by name, in base64: those of a policy.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub controller_files: BTreeMap<String, String>,
    /// Figures of the tasks that differ from the protocol's.
    pub rules: toml::Table,
}

/// Reads a config as config files are read, whatever format it stands in here: so its structs are compiled for one format. In TOML an optional field that is not
/// set is absent.
pub(crate) fn config<'de, D: Deserializer<'de>, T: DeserializeOwned>(deserializer: D) -> Result<T, D::Error> {
    let mut value = serde_json::Value::deserialize(deserializer)?;
    remove_nulls(&mut value);
    let table = toml::Table::deserialize(value).map_err(D::Error::custom)?;
    orchard_quantity::from_table("scenario", table).map_err(D::Error::custom)
}

fn remove_nulls(value: &mut serde_json::Value) {
    match value {
        serde_json::Value::Object(fields) => {
            fields.retain(|_, value| !value.is_null());
            fields.values_mut().for_each(remove_nulls);
        }
        serde_json::Value::Array(values) => values.iter_mut().for_each(remove_nulls),
        _ => {}
    }
}

impl Scenario {
    /// Returns the stored form of the scenario.
    pub fn stored(&self) -> StoredScenario {
        StoredScenario {
            names: self.names.clone(),
            hash: self.hash(),
            world: Box::new((*self.spec).clone()),
            tree_file: self.tree.as_deref().cloned(),
            robot_files: self.robot_files.as_deref().cloned().map(Box::new),
            detector_config: Box::new(self.detector.clone()),
            detector_by_default: self.detector_by_default,
            controller_configs: self.controller.configs(),
            controller_files: {
                let files = self.controller.files().into_iter();
                files.map(|(name, bytes)| (name.to_owned(), STANDARD.encode(bytes))).collect()
            },
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
            robot: robot::of_result(&given("robot", &names.scene.robot), stored.robot_files.as_deref())?,
            robot_files: stored.robot_files.as_deref().cloned().map(Arc::new),
            controller: Arc::new(Kind::default()),
            spec: Arc::new((*stored.world).clone()),
            tree: stored.tree_file.clone().map(Arc::new),
            detector: (*stored.detector_config).clone(),
            detector_by_default: stored.detector_by_default,
            rules: stored.rules.clone(),
            layers: Layers::of_one(by, &stored.world),
            names,
        };
        let scenario = scenario.under_stored(stored, controllers, by)?;
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
