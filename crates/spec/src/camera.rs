//! Depth cameras.

use orchard_quantity::{ConfigError, Count, Quantity, Span};
use serde::{Deserialize, Serialize};

/// The camera `paper` as TOML text.
pub const PAPER_TOML: &str = include_str!("../configs/camera/paper.toml");

/// The depth cameras that a config can choose: `[camera.NAME]` holds what differs from that camera's own file,
/// `configs/camera/NAME.toml`. The mount pose belongs to the robot's config.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CameraSpec {
    /// Measures the depth of every surface exactly, at any range.
    Ideal(IdealSpec),
    /// The paper's: exact within its range.
    Paper(PaperSpec),
}

/// Size, field of view and rate of a pinhole camera with its axis in the middle of the image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewSpec {
    /// Columns.
    pub width: Count,
    /// Rows.
    pub height: Count,
    /// Horizontal field of view; without it pixels are square.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub horizontal_fov: Option<Quantity>,
    /// Vertical field of view.
    pub vertical_fov: Quantity,
    /// Image rate.
    pub rate: Quantity,
}

/// A camera without errors or limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IdealSpec {
    /// What it sees.
    pub view: ViewSpec,
}

/// A camera without errors within its range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperSpec {
    /// What it sees.
    pub view: ViewSpec,
    /// Valid depths; a nearer surface occludes but reads as invalid.
    pub range: Span,
}

impl CameraSpec {
    /// The cameras that come with the crate: their names and files.
    pub const FILES: &[(&str, &str)] =
        &[("ideal", include_str!("../configs/camera/ideal.toml")), ("paper", PAPER_TOML)];

    /// A camera that comes with the crate.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn named(name: &str) -> Result<Self, String> {
        if Self::FILES.iter().all(|(known, _)| *known != name) {
            let names: Vec<&str> = Self::FILES.iter().map(|(known, _)| *known).collect();
            return Err(format!("no camera '{name}'; the cameras are: {}", names.join(", ")));
        }
        Self::from_toml(name, &format!("[{name}]")).map_err(|e| e.to_string())
    }

    /// Reads a camera from TOML text with one table, its name; `file` names it in errors. What the text leaves open
    /// is as in that camera's own file.
    ///
    /// # Errors
    /// Not TOML, no camera or more than one, a field unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        crate::preset::read_camera(file, text)
    }

    /// Name of the model, as configs and command lines write it.
    pub fn name(&self) -> &'static str {
        match self {
            CameraSpec::Ideal(_) => "ideal",
            CameraSpec::Paper(_) => "paper",
        }
    }

    /// Size, field of view and rate.
    pub fn view(&self) -> &ViewSpec {
        match self {
            CameraSpec::Ideal(camera) => &camera.view,
            CameraSpec::Paper(camera) => &camera.view,
        }
    }

    /// Nearest and farthest valid depth [m].
    pub fn range(&self) -> (f64, f64) {
        match self {
            CameraSpec::Ideal(_) => (0.0, f64::INFINITY),
            CameraSpec::Paper(camera) => camera.range.si(),
        }
    }
}
