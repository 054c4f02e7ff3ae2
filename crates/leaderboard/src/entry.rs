//! One submission on the board.

use orchard_statistics::Metric;
use orchard_tasks::harvest::matrix::NOMINAL;
use serde::{Deserialize, Serialize};

use crate::refusal::Refusal;
use crate::rules::LeaderboardRules;
use crate::verify::Verified;

/// Largest damage per tree allowed for a submission, mean over its nominal episodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// Name in the protocol; null for a custom budget.
    pub class: Option<String>,
    /// Branches snapped per tree.
    pub snapped: f64,
    /// Fruit dropped per tree.
    pub dropped: f64,
}

impl Budget {
    /// A budget of the protocol by name; `None` if the name is unknown.
    pub fn of_class(rules: &LeaderboardRules, class: &str) -> Option<Self> {
        let budget = rules.budgets.get(class)?;
        let (snapped, dropped) = (budget.snapped.si(), budget.dropped.si());
        Some(Self { class: Some(class.to_owned()), snapped, dropped })
    }

    /// A custom budget.
    ///
    /// # Errors
    /// A figure that is not finite and at least 0.
    pub fn of_figures(snapped: f64, dropped: f64) -> Result<Self, String> {
        for (name, value) in [("snapped", snapped), ("dropped", dropped)] {
            if !value.is_finite() || value < 0.0 {
                return Err(format!("{name} = {value} per tree: must be a finite number >= 0"));
            }
        }
        Ok(Self { class: None, snapped, dropped })
    }

    /// True if an amount of damage per tree is within the budget.
    pub fn admits(&self, snapped: f64, dropped: f64) -> bool {
        snapped <= self.snapped && dropped <= self.dropped
    }
}

impl std::fmt::Display for Budget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(class) = &self.class {
            write!(f, "{class}: ")?;
        }
        write!(f, "snapped <= {}, dropped <= {}", self.snapped, self.dropped)
    }
}

/// A verified submission. All figures are of the nominal condition, by the definitions of the benchmark.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Name, unique on its board.
    pub name: String,
    /// Controller that harvested.
    pub controller: String,
    /// Budget that was chosen for it.
    pub budget: Budget,
    /// True if the damage of the entry is within its budget.
    pub within_budget: bool,
    /// Harvest completeness.
    pub completeness: f64,
    /// 95 % interval.
    pub completeness_ci95: [Option<f64>; 2],
    /// Branches snapped per tree.
    pub snapped_per_tree: f64,
    /// Fruit dropped per tree.
    pub dropped_per_tree: f64,
    /// Fruit deposited per minute.
    pub throughput_fruit_per_min: Option<f64>,
    /// Placed attempts over attempts.
    pub place_success_per_attempt: Option<f64>,
    /// Episodes of all conditions.
    pub episodes: u32,
    /// Number of these with a quarantined world.
    pub quarantined: u32,
    /// Code version.
    pub code_version: String,
    /// SHA-256 of all config texts.
    pub config_hash: String,
    /// SHA-256 over the names and bytes of all record files.
    pub records_sha256: String,
    /// Episodes that were run again and had the same bytes.
    pub sample: Vec<String>,
}

impl Entry {
    /// A verified result under a name and a budget.
    ///
    /// # Errors
    /// A nominal figure is undefined: for example, no tree had a reachable fruit.
    pub fn new(name: &str, budget: Budget, verified: &Verified) -> Result<Self, Refusal> {
        let summary = &verified.summary;
        let nominal = summary.conditions.get(NOMINAL);
        let metric = |name: &str| -> Option<&Metric> { nominal?.metrics.get(name) };
        let mean = |name: &'static str| metric(name).and_then(|m| m.mean);
        let needed = |name: &'static str| mean(name).ok_or(Refusal::NothingToRank { metric: name });
        let (snapped, dropped) = (needed("branches_snapped_per_tree")?, needed("fruit_dropped_per_tree")?);
        Ok(Self {
            name: name.to_owned(),
            controller: summary.controller.clone(),
            within_budget: budget.admits(snapped, dropped),
            budget,
            completeness: needed("harvest_completeness")?,
            completeness_ci95: metric("harvest_completeness").map_or([None; 2], |m| m.ci95),
            snapped_per_tree: snapped,
            dropped_per_tree: dropped,
            throughput_fruit_per_min: mean("throughput_fruit_per_min"),
            place_success_per_attempt: mean("place_success_per_attempt"),
            episodes: summary.conditions.values().map(|c| c.episodes.len() as u32).sum(),
            quarantined: summary.quarantined,
            code_version: summary.code_version.clone(),
            config_hash: summary.config_hash.clone(),
            records_sha256: verified.records_sha256.clone(),
            sample: verified.sample.clone(),
        })
    }

    /// Damage per tree: branches snapped and fruit dropped.
    pub fn damage(&self) -> f64 {
        self.snapped_per_tree + self.dropped_per_tree
    }
}
