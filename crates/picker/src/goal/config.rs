//! The config of component tasks.

use super::GOAL_TOML;
use orchard_quantity::{ConfigError, Quantity, from_toml};
use serde::{Deserialize, Serialize};

/// What the controllers of component tasks add to the picker's config.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalConfig {
    /// A push to a point.
    pub push: PushConfig,
    /// What makes it compliant.
    pub compliance: ComplianceConfig,
}

/// A push to a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PushConfig {
    /// Distance before the point at which the straight way begins.
    pub length: Quantity,
    /// Speed of the hand.
    pub speed: Quantity,
    /// Opening of each finger.
    pub opening: Quantity,
    /// Farthest that the base stands off the named side, as seen from the place.
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
    /// Resistance from which it goes back.
    #[serde(rename = "yield")]
    pub yields: Quantity,
    /// Speed of going back per speed of the push.
    pub back: Quantity,
    /// Force from the side per speed at which the hand gives way.
    pub drag: Quantity,
    /// Farthest that this leads off the line.
    pub aside: Quantity,
    /// Time without progress after which another way is tried.
    pub patience: Quantity,
    /// How far the hand goes back before that.
    pub retry: Quantity,
    /// How far off the line another way goes.
    pub detour: Quantity,
    /// Less way than this is no progress.
    pub progress: Quantity,
}

impl GoalConfig {
    /// Reads a config from TOML text; `file` names it in errors.
    ///
    /// # Errors
    /// Not TOML, a field missing or unknown, a value outside its range, no room between the two resistances.
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

    /// The preset `paper`.
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
