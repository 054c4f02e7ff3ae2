//! Leaves.

use orchard_quantity::Quantity;
use serde::{Deserialize, Serialize};

/// Leaf density and shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoliageSpec {
    /// The foliage dial: 0 is no leaf, 1 the reference density.
    pub density: Quantity,
}
