//! Constants of the statistics, read with the protocol.

use orchard_quantity::{Count, Quantity};
use serde::{Deserialize, Serialize};

/// Rules for bootstrap confidence intervals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BootstrapRules {
    /// Number of resamples.
    pub resamples: Count,
    /// Coverage of the interval.
    pub confidence: Quantity,
    /// Seed of the resampling stream.
    pub seed: Count,
}

/// Constants of paired tests.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairedRules {
    /// Most pairs for which the signed-rank distribution is counted out; beyond, or with ties, it is approximated.
    pub wilcoxon_exact: Count,
    /// Most pairs for which every change of signs is tried.
    pub permutation_exact: Count,
    /// Random changes of signs where there are more.
    pub permutations: Count,
    /// Seed of their stream.
    pub seed: Count,
}
