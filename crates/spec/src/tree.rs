//! How a tree grows.

use orchard_quantity::Quantity;
use serde::{Deserialize, Serialize};

/// Grammar, pipe model and placement of the tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TreeSpec {
    /// Height after rescaling.
    pub height: Quantity,
}
