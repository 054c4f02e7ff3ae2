//! The leaderboard's constants: the table `[leaderboard]` of the protocol.

use std::collections::BTreeMap;

use orchard_quantity::{ConfigError, Quantity};
use orchard_tasks::protocol::Protocol;
use serde::{Deserialize, Serialize};

/// The leaderboard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeaderboardRules {
    /// Budgets that have a name.
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

/// Damage a tree that a submission may do at most.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BudgetRules {
    /// Branches snapped a tree.
    pub snapped: Quantity,
    /// Fruit dropped a tree.
    pub dropped: Quantity,
}
