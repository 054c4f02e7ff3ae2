//! Changes of a scenario, as the conditions of a benchmark make them.

use orchard_spec::camera::CameraSpec;
use orchard_spec::{Preset, Spec};
use serde::{Deserialize, Serialize};

use crate::limits;
use crate::resolve::detector;
use crate::{Names, OptionValue, Scenario, ScenarioError, SceneNames, robot};
use orchard_perception::config::LEARNED;
use orchard_perception::detector_for;

/// Differences from a scenario. A field without a value leaves its part of the scenario as it is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Changes {
    /// Name of the preset of the world; the camera stays.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Name of the camera; its detector comes with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// Name of the detector, instead of the camera's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detector: Option<String>,
    /// Name of the robot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// Figures of the world, as a config with a base gives them.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub world: toml::Table,
}

impl Changes {
    /// True if there is nothing to change.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the world's config with the changes. `by` names them in errors.
    ///
    /// # Errors
    /// An unknown name, a field unknown, a value outside its range.
    pub fn of_world(&self, spec: &Spec, by: &str) -> Result<Spec, ScenarioError> {
        let error = |field: &str, problem: String| ScenarioError::new(format!("{by}: {field}"), problem);
        let mut changed = match &self.preset {
            None => spec.clone(),
            Some(preset) => {
                let preset: Preset = preset.parse().map_err(|e| error("preset", e))?;
                Spec { camera: spec.camera.clone(), ..Spec::preset(preset) }
            }
        };
        if let Some(camera) = &self.camera {
            changed.camera = CameraSpec::named(camera).map_err(|e| error("camera", e))?;
        }
        if !self.world.is_empty() {
            let laid = changed.overlaid("world", self.world.clone());
            changed = laid.map_err(|e| error(&format!("{}.{}", e.file, e.field), e.problem))?;
        }
        match limits::of_world(&changed) {
            Some((field, problem)) => Err(error(&field, problem)),
            None => Ok(changed),
        }
    }
}

impl Scenario {
    /// Returns the scenario with changes; `by` names them in errors. The detector goes with the camera unless somebody named it.
    ///
    /// # Errors
    /// As [`Changes::of_world`], or an unknown detector or robot.
    pub fn changed(&self, changes: &Changes, by: &str) -> Result<Self, ScenarioError> {
        let mut scene = self.names.scene.clone();
        let mut changed = self.with_spec(changes.of_world(&self.spec, by)?);
        if let Some(preset) = &changes.preset {
            scene.preset.clone_from(preset);
            scene.randomisation = SceneNames::OF_PRESET.to_owned();
        }
        if let Some(camera) = &changes.camera {
            if self.detector_by_default {
                scene.detector = detector_for(camera, false).to_owned();
                changed.detector = detector(&OptionValue::new(&scene.detector, by), camera)?;
            } else if LEARNED.contains(&scene.detector.as_str()) {
                changed.detector = detector(&OptionValue::new(&scene.detector, by), camera)?;
            }
            scene.camera.clone_from(camera);
        }
        if let Some(name) = &changes.detector {
            changed.detector = detector(&OptionValue::new(name, format!("{by}: detector")), &scene.camera)?;
            scene.detector.clone_from(name);
            changed.detector_by_default = false;
        }
        if let Some(name) = &changes.robot {
            let found = robot::find(&OptionValue::new(name, format!("{by}: robot")))?;
            (changed.robot, changed.robot_files) = (found.robot, found.files);
            scene.robot = found.name;
        }
        changed.names = Names { scene, ..changed.names };
        Ok(changed)
    }

    /// Returns the scenario with the default detector for depth images that come with colour ([`detector_for`]), or as it is if somebody named a detector.
    ///
    /// # Errors
    /// The detector does not fit the camera.
    pub fn for_images(&self) -> Result<Self, ScenarioError> {
        let camera = self.spec.camera.name();
        let name = detector_for(camera, true);
        if !self.detector_by_default || name == self.names.scene.detector {
            return Ok(self.clone());
        }
        let given = OptionValue::new(name, format!("the detector for images of camera {camera}"));
        let mut changed = self.clone();
        changed.detector = detector(&given, camera)?;
        name.clone_into(&mut changed.names.scene.detector);
        Ok(changed)
    }

    /// Returns the scenario with its rules laid over the protocol of a name instead of the one that they name, if any.
    #[must_use]
    pub fn on_protocol(&self, name: &str) -> Self {
        let mut rules = self.rules.clone();
        rules.insert(Self::PROTOCOL.to_owned(), toml::Value::from(name));
        Self { rules, ..self.clone() }
    }

    /// Field of the rules that names the protocol that they change.
    pub const PROTOCOL: &'static str = "base";

    /// True if the scenario changes figures of its protocol.
    pub(crate) fn changes_rules(&self) -> bool {
        self.rules.keys().any(|key| key != Self::PROTOCOL)
    }
}
