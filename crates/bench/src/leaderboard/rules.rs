//! The leaderboard's constants: the table `[leaderboard]` of the protocol.

use std::collections::BTreeMap;

use orchard_quantity::{Count, Quantity};
use serde::{Deserialize, Serialize};

/// The leaderboard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeaderboardRules {
    /// Episodes of a submission that are run again.
    pub sample: Count,
    /// Budgets that have a name.
    pub budgets: BTreeMap<String, BudgetRules>,
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
