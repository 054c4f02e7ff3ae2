//! The leaderboard's constants: the table `[leaderboard]` of the protocol.

use std::collections::BTreeMap;

use orchard_quantity::{ConfigError, Count, Quantity};
use orchard_tasks::protocol::Protocol;
use serde::{Deserialize, Serialize};

/// The leaderboard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeaderboardRules {
    /// Episodes of a submission that are run again.
    pub sample: Count,
    /// Named budgets.
    pub budgets: BTreeMap<String, BudgetRules>,
}

impl LeaderboardRules {
    /// Reads the section `leaderboard` of a protocol.
    ///
    /// # Errors
    /// A field missing or unknown, or a value outside its range.
    pub fn of(protocol: &Protocol) -> Result<Self, ConfigError> {
        protocol.section("leaderboard")
    }
}

/// Largest damage per tree allowed for a submission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BudgetRules {
    /// Branches snapped per tree.
    pub snapped: Quantity,
    /// Fruit dropped per tree.
    pub dropped: Quantity,
}
