//! Sampling rates and thresholds of recordings.

use orchard_quantity::{ConfigError, Count, Quantity, from_toml};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// The defaults as TOML text.
pub const PAPER_TOML: &str = include_str!("../configs/paper/recording.toml");

/// Sampling rates and thresholds of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingConfig {
    /// Poses.
    pub transforms: TransformRules,
    /// Point clouds.
    pub points: PointRules,
    /// Hashes of the state.
    pub state: StateRules,
}

/// Rules for recording poses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransformRules {
    /// Rate at which the poses that have changed are recorded.
    pub rate: Quantity,
    /// Rate at which all poses are recorded.
    pub whole: Quantity,
    /// Largest translation that counts as no change.
    pub distance: Quantity,
    /// Largest rotation that counts as no change.
    pub angle: Quantity,
}

/// Rules for thinning a depth image to a point cloud.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointRules {
    /// Columns and rows from point to point.
    pub stride: Count,
}

/// Rules for recording hashes of the state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StateRules {
    /// Rate at which hashes are recorded.
    pub rate: Quantity,
}

impl RecordingConfig {
    /// Reads a config from TOML text; `file` names it in errors.
    ///
    /// # Errors
    /// Not TOML, a field missing or unknown, a value outside its range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        from_toml(file, text)
    }

    /// The defaults.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn paper() -> Self {
        match Self::from_toml("paper/recording.toml", PAPER_TOML) {
            Ok(config) => config,
            Err(e) => unreachable!("embedded preset: {e}"),
        }
    }

    /// SHA-256 of the values, hexadecimal: files recorded under other values have other bytes.
    pub fn hash(&self) -> String {
        let text =
            serde_json::to_vec(self).unwrap_or_else(|e| unreachable!("config from TOML is also JSON: {e}"));
        hexadecimal(&Sha256::digest(text))
    }
}

/// Bytes as hexadecimal digits.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_config_reads_and_its_hash_tells_values_apart() {
        let config = RecordingConfig::paper();
        assert_eq!(config.transforms.rate.si(), 30.0);
        let mut other = config.clone();
        other.points.stride = other.points.stride.with_value(5).unwrap();
        assert_ne!(config.hash(), other.hash());
        assert_eq!(config.hash().len(), 64);
        assert!(RecordingConfig::from_toml("x", "[points]").is_err());
    }
}
