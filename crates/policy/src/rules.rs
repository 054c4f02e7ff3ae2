//! Scales of actions, and how pictures are taken: `configs/policy/v1.toml`.

use orchard_quantity::{ConfigError, Count, Quantity, from_toml};
use serde::{Deserialize, Serialize};

/// The scales as TOML text.
pub const V1_TOML: &str = include_str!("../configs/policy/v1.toml");

/// Scales of actions, and rules of pictures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scales {
    /// Version; it is raised when a figure changes.
    pub version: String,
    /// Largest speed of a joint's set point under the controls `joint_delta` and `ee_delta`, as a share of the joint's largest speed.
    pub joint_speed: Quantity,
    /// Speed of the tool's set point along an axis of the base frame under action 1 of control `ee_delta`.
    pub tool_speed: Quantity,
    /// Turn rate about an axis of the base frame.
    pub tool_turn_speed: Quantity,
    /// Steps of inverse kinematics by which the joints follow the tool's set point.
    pub tool_steps: Count,
    /// Colour pictures.
    pub pixels: PixelRules,
}

/// Rules of colour pictures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PixelRules {
    /// Place of the fixed camera from the arm's shoulder, base frame, in lengths of the arm.
    pub eye: [Quantity; 3],
    /// The point in the middle of its picture, likewise.
    pub aim: [Quantity; 3],
    /// Vertical field of view.
    pub vertical_fov: Quantity,
    /// Samples a pixel side.
    pub supersampling: Count,
    /// Pixels a side of the map of the sun's shadow.
    pub sun_map: Count,
    /// Pixels a side of the maps of the sky's light.
    pub sky_map: Count,
}

impl Scales {
    /// Reads the scales from TOML text; `file` names it in errors.
    ///
    /// # Errors
    /// Not TOML, a field missing or unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        from_toml(file, text)
    }

    /// The scales of version 1.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn v1() -> Self {
        match Self::from_toml("policy/v1.toml", V1_TOML) {
            Ok(scales) => scales,
            Err(e) => unreachable!("embedded scales: {e}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_scales_read_and_a_wrong_one_is_named() {
        assert_eq!(Scales::v1().version, "v1");
        let text = V1_TOML.replacen("joint_speed = { value = 0.5", "joint_speed = { value = 2.0", 1);
        let e = Scales::from_toml("x.toml", &text).unwrap_err().to_string();
        assert!(e.starts_with("x.toml: joint_speed: ") && e.contains('2'), "{e}");
    }
}
