//! Weights of rewards and costs, and words of instructions: `configs/learning/v1.toml`.

use orchard_quantity::{ConfigError, Quantity, from_toml};
use serde::{Deserialize, Serialize};

/// The figures of the learning interface as TOML text.
pub const V1_TOML: &str = include_str!("../configs/learning/v1.toml");

/// Figures of the learning interface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearningRules {
    /// Version; it is raised when a figure changes.
    pub version: String,
    /// Weights of the cost.
    pub cost: CostRules,
    /// Weights of the reward of `Harvest-v1`.
    pub harvest: HarvestReward,
    /// Weights of the reward of `Reach-v1`.
    pub reach: ReachReward,
    /// Weights of the reward of `Gentle-v1`.
    pub gentle: GentleReward,
    /// Instructions in words.
    pub instruction: InstructionRules,
}

/// Weights of the cost of a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CostRules {
    /// A joint of the tree broke.
    pub branch_snapped: Quantity,
    /// A fruit touched the ground.
    pub fruit_dropped: Quantity,
    /// A spur tore off with its fruit.
    pub spur_torn: Quantity,
}

/// Weights of the terms of `Harvest-v1`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HarvestReward {
    /// A fruit came to rest in the bucket for the first time.
    pub deposit: Quantity,
    /// The hand gripped a fruit for the first time.
    pub grip: Quantity,
    /// A fruit came off in the hand.
    pub detach: Quantity,
    /// Way towards the nearest reachable fruit on the tree \[1/m\].
    pub approach: Quantity,
    /// Way towards the bucket of fruit that the hand took off \[1/m\].
    pub carry: Quantity,
    /// The cost, subtracted.
    pub damage: Quantity,
}

/// Weights of the terms of `Reach-v1`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReachReward {
    /// The named fruit was held for the task's time.
    pub success: Quantity,
    /// The hand gripped the named fruit for the first time.
    pub grip: Quantity,
    /// Way towards the named fruit \[1/m\].
    pub approach: Quantity,
    /// The cost, subtracted.
    pub damage: Quantity,
}

/// Weights of the terms of `Gentle-v1`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GentleReward {
    /// The tool came to the point.
    pub success: Quantity,
    /// Way towards the point \[1/m\].
    pub approach: Quantity,
    /// Impulse of the robot's contacts with wood, subtracted \[1/(N s)\].
    pub impulse: Quantity,
    /// The cost, subtracted.
    pub damage: Quantity,
}

/// By how much a fruit must differ from others to be named by it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InstructionRules {
    /// In radius.
    pub size_margin: Quantity,
    /// In height or distance.
    pub place_margin: Quantity,
}

impl LearningRules {
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
        match Self::from_toml("learning/v1.toml", V1_TOML) {
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
        assert_eq!(LearningRules::v1().version, "v1");
        let text = V1_TOML.replacen("deposit = { value = 1.0", "deposit = { value = -2.0", 1);
        let e = LearningRules::from_toml("x.toml", &text).unwrap_err().to_string();
        assert!(e.starts_with("x.toml: harvest.deposit: ") && e.contains('2'), "{e}");
    }
}
