//! Names of a scenario's parts in results.

use std::path::Path;

use orchard_robot::RobotModel;
use serde::{Deserialize, Serialize};

/// Prefix of a controller's option that names a policy's network.
pub(crate) const POLICY: &str = "onnx:";

/// Prefix of the names of policies from files, in results.
pub(crate) const NAMED: &str = "onnx-";

/// The name that a controller's option gives it in results.
pub fn controller_name(value: &str) -> String {
    let Some(path) = value.strip_prefix(POLICY) else { return value.to_owned() };
    let stem = Path::new(path).file_stem().unwrap_or_default().to_string_lossy();
    let plain = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    format!("{NAMED}{}", stem.chars().map(plain).collect::<String>())
}

/// Names of the scene: all parts but the controller.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneNames {
    /// Preset, or the name in a config file.
    pub preset: String,
    /// File name of a digitised tree; `grown` if every world grows its own tree.
    pub tree: String,
    /// Strength of the randomisation or name of its file; `preset` for the config's own.
    pub randomisation: String,
    /// Robot.
    pub robot: String,
    /// Camera model, or name of its file.
    pub camera: String,
    /// Detector, or name of its file.
    pub detector: String,
}

/// Names of all parts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Names {
    /// All but the controller.
    #[serde(flatten)]
    pub scene: SceneNames,
    /// Controller.
    pub controller: String,
}

impl SceneNames {
    /// Name for grown trees.
    pub const GROWN: &str = "grown";
    /// Name for the config's own randomisation.
    pub const OF_PRESET: &str = "preset";

    /// The names with their options, in the order of the command line.
    pub fn list(&self) -> [(&'static str, &str); 6] {
        [
            ("preset", &self.preset),
            ("tree", &self.tree),
            ("randomisation", &self.randomisation),
            ("robot", &self.robot),
            ("camera", &self.camera),
            ("detector", &self.detector),
        ]
    }
}

impl Names {
    /// Names of the benchmark's own scenario under a controller.
    pub fn paper(controller: &str) -> Self {
        let paper = || "paper".to_owned();
        Self {
            scene: SceneNames {
                preset: paper(),
                tree: SceneNames::GROWN.to_owned(),
                randomisation: SceneNames::OF_PRESET.to_owned(),
                robot: RobotModel::PAPER.to_owned(),
                camera: paper(),
                detector: paper(),
            },
            controller: controller.to_owned(),
        }
    }
}

impl SceneNames {
    /// Names of the benchmark's own scene.
    pub fn paper() -> Self {
        Names::paper("").scene
    }
}
