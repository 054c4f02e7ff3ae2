//! Figures of demonstrations: `configs/demos/v1.toml`.

use orchard_quantity::{ConfigError, Quantity, from_toml};
use serde::{Deserialize, Serialize};

/// The figures as TOML text.
pub const V1_TOML: &str = include_str!("../configs/demos/v1.toml");

/// Figures of demonstrations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DemosRules {
    /// Depth of value 1 in the depth images.
    pub depth_unit: Quantity,
    /// Shares of trees by their use.
    pub split: SplitRules,
}

/// Shares of trees by their use; all others are for training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SplitRules {
    /// Share for validation.
    pub validation: Quantity,
    /// Share for tests.
    pub test: Quantity,
}

impl DemosRules {
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
        match Self::from_toml("demos/v1.toml", V1_TOML) {
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
        assert!((DemosRules::v1().depth_unit.si() - 1e-3).abs() < 1e-15);
        let text = V1_TOML.replacen("test = { value = 0.1", "test = { value = 1.1", 1);
        let e = DemosRules::from_toml("x.toml", &text).unwrap_err().to_string();
        assert!(e.starts_with("x.toml: split.test: "), "{e}");
    }
}
