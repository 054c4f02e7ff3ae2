//! Config of the controllers of component tasks.

use orchard_quantity::{ConfigError, Quantity, from_toml};
use serde::{Deserialize, Serialize};

/// Config of the component tasks' controllers as TOML text.
pub const GOAL_TOML: &str = include_str!("../../configs/paper/goal.toml");

/// Config that the controllers of component tasks use beside the picker's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalConfig {
    /// A push to a point.
    pub push: PushConfig,
    /// Compliance of a push.
    pub compliance: ComplianceConfig,
}

/// A push to a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PushConfig {
    /// Length of the straight stretch that ends at the point.
    pub length: Quantity,
    /// Speed of the hand.
    pub speed: Quantity,
    /// Opening of each finger.
    pub opening: Quantity,
    /// Largest angle between the base's bearing and the given side, as seen from the point.
    pub side: Quantity,
    /// Longest duration.
    pub timeout: Quantity,
}

/// A compliant push.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComplianceConfig {
    /// Time over which the force is read before the push.
    pub still: Quantity,
    /// Weight of a frame's force in the running mean.
    pub force_weight: Quantity,
    /// Resistance from which the hand slows.
    pub free: Quantity,
    /// Resistance from which the hand goes back.
    #[serde(rename = "yield")]
    pub yields: Quantity,
    /// Largest speed backwards, as a share of the push's speed.
    pub back: Quantity,
    /// Sideways force per sideways speed of the hand.
    pub drag: Quantity,
    /// Largest sideways displacement by such forces.
    pub aside: Quantity,
    /// Time without progress after which the next detour is tried.
    pub patience: Quantity,
    /// Distance that the hand goes back before the next detour.
    pub retry: Quantity,
    /// Largest distance of a detour from the straight line.
    pub detour: Quantity,
    /// Least distance that counts as progress.
    pub progress: Quantity,
}

impl GoalConfig {
    /// Reads a config from TOML text; `file` names the config in errors.
    ///
    /// # Errors
    /// The text is not TOML, a field is missing or unknown, a value lies outside its range, or `yield` is not above `free`.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        let config: Self = from_toml(file, text)?;
        let c = &config.compliance;
        if c.yields.si() > c.free.si() {
            return Ok(config);
        }
        Err(ConfigError {
            file: file.to_owned(),
            field: "compliance.yield".to_owned(),
            problem: format!("{} N is not above compliance.free, {} N", c.yields.si(), c.free.si()),
        })
    }

    /// Returns the config that comes with the crate.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn paper() -> Self {
        match Self::from_toml("paper/goal.toml", GOAL_TOML) {
            Ok(config) => config,
            Err(e) => unreachable!("embedded preset: {e}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resistances_in_the_wrong_order_are_refused() {
        assert!(GoalConfig::from_toml("goal.toml", GOAL_TOML).is_ok());
        let text = GOAL_TOML.replacen("free = { value = 6.0", "free = { value = 18.0", 1);
        let e = GoalConfig::from_toml("x.toml", &text).unwrap_err().to_string();
        assert_eq!(e, "x.toml: compliance.yield: 18 N is not above compliance.free, 18 N");
    }
}
