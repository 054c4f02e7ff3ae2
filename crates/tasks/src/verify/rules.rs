//! The constants of open-loop verification: `[verify]` of `configs/bench/v1.toml`.

use orchard_quantity::Quantity;
use serde::{Deserialize, Serialize};

/// Open-loop verification.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VerifyRules {
    /// Time for which the last posture is held.
    pub settle: Quantity,
    /// Longest trajectory.
    pub longest: Quantity,
}
