//! Figures of a world that is played live: `configs/play/v1.toml`.

use orchard_quantity::{ConfigError, Quantity, from_toml};
use serde::{Deserialize, Serialize};

/// The figures as TOML text.
pub const V1_TOML: &str = include_str!("../configs/play/v1.toml");

/// Figures of a world that is played live.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlayRules {
    /// Version; it is raised when a figure changes.
    pub version: String,
    /// The hand.
    pub hand: HandRules,
    /// The ground.
    pub ground: GroundRules,
    /// Trees beside the one that moves.
    pub stand: StandRules,
    /// The robot driven by hand.
    pub jog: JogRules,
}

/// Figures of the hand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HandRules {
    /// Stiffness of the spring between the grabbed place and the pointer.
    pub stiffness: Quantity,
    /// Largest force of the spring.
    pub largest_force: Quantity,
    /// Force by which the compliance of the grabbed place is measured.
    pub probe_force: Quantity,
    /// Angle by which the pointer may miss what it grabs.
    pub grab_angle: Quantity,
    /// Angle within which the keyboard grabs what is nearest to the middle of the picture.
    pub key_grab_angle: Quantity,
}

/// Figures of the ground as it is drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundRules {
    /// Half the side of the level ground.
    pub extent: Quantity,
}

/// Places of trees beside the one that moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StandRules {
    /// Distance of rows.
    pub row_distance: Quantity,
    /// Distance of trees in a row.
    pub tree_distance: Quantity,
}

/// Speeds of a robot that is driven by hand, at full deflection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JogRules {
    /// Speed of the base.
    pub base_speed: Quantity,
    /// Turn rate of the base.
    pub base_turn: Quantity,
    /// Speed of the hand in the base frame.
    pub hand_speed: Quantity,
    /// Turn rate of the hand.
    pub hand_turn: Quantity,
    /// Time in which a speed is reached from rest.
    pub rise: Quantity,
    /// Distance by which the wished place of the hand may be ahead of a reachable one.
    pub lead: Quantity,
}

impl PlayRules {
    /// Reads the figures from TOML text; `file` names it in errors.
    ///
    /// # Errors
    /// Not TOML, a field missing or unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        from_toml(file, text)
    }

    /// The figures of version 1.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn v1() -> Self {
        match Self::from_toml("play/v1.toml", V1_TOML) {
            Ok(rules) => rules,
            Err(e) => unreachable!("embedded figures: {e}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_figures_read_and_a_wrong_one_is_named() {
        assert_eq!(PlayRules::v1().version, "v1");
        let text = V1_TOML.replacen("stiffness = { value = 400.0", "stiffness = { value = 0.0", 1);
        let e = PlayRules::from_toml("x.toml", &text).unwrap_err().to_string();
        assert!(e.starts_with("x.toml: hand.stiffness: "), "{e}");
    }
}
