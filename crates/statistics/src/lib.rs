//! Statistics of results: intervals, paired tests, effect sizes, corrections, variance components.
//!
//! Everything here is a function of its arguments: elementary functions come from `orchard_geometry::math`, random numbers from
//! seeded streams, so p-values and intervals are the same bits on every platform. A figure that a sample does not define comes with its
//! reason ([`Undefined`]) and is never a NaN. `cargo xtask check-statistics` holds all of it against scipy and scikit-learn.

pub mod bootstrap;
pub mod comparison;
pub mod components;
pub mod design;
pub mod effect;
pub mod holm;
pub mod metric;
pub mod morris;
pub mod permutation;
pub mod quantile;
pub mod ranking;
pub mod ranks;
pub mod rules;
mod undefined;
pub mod wilcoxon;

#[cfg(test)]
mod coverage_tests;
#[cfg(test)]
mod test_rules;

pub use bootstrap::{Resamples, Share};
pub use comparison::{Comparison, compare};
pub use components::{Component, VarianceComponents, variance_components};
pub use design::Design;
pub use metric::{
    Metric, MetricDefinition, MetricInfo, QuantileDefinition, components_of_metrics, estimate,
    estimate_quantiles,
};
pub use rules::{BootstrapRules, PairedRules};
pub use undefined::{Figure, Undefined};
