//! Checks of plans that all tasks share.

use std::collections::BTreeSet;

/// Most records of a task, our own choice: 100,000 episodes of 75 s are 87 days of simulated time. A harvest of so many takes 480 MiB
/// (measured).
pub const MOST_RECORDS: u64 = 100_000;

/// A plan that cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// No condition.
    #[error("no condition given")]
    NoConditions,
    /// A condition given twice.
    #[error("condition {0} is given twice")]
    ConditionTwice(String),
    /// No seed.
    #[error("no seed given")]
    NoSeeds,
    /// A seed given twice.
    #[error("seed {0} is given twice")]
    SeedTwice(u64),
    /// No tree.
    #[error("0 trees: at least 1 tree per seed is needed")]
    NoTrees,
    /// More than [`MOST_RECORDS`].
    #[error("conditions x seeds x trees x repeats give {0} records; a task has at most {MOST_RECORDS}")]
    TooMany(u64),
    /// No episode.
    #[error("0 repeats: at least 1 episode per tree is needed")]
    NoRepeats,
    /// A controller that cannot be given a goal.
    #[error("controller {0} cannot be given a goal, which this task needs")]
    NoGoals(String),
    /// A horizon outside its range.
    #[error("horizon {horizon} s is outside the allowed range: one frame ({frame:.4} s) to 100 hours")]
    Horizon {
        /// The budget \[s\].
        horizon: f64,
        /// Frame length \[s\].
        frame: f64,
    },
}

/// Checks the seeds and the number of trees per seed.
///
/// # Errors
/// No seed, a seed given twice, no tree, or more than [`MOST_RECORDS`] trees.
pub fn check_trees(seeds: &[u64], trees: u32) -> Result<(), PlanError> {
    if seeds.is_empty() {
        return Err(PlanError::NoSeeds);
    }
    let mut seen = BTreeSet::new();
    if let Some(seed) = seeds.iter().find(|seed| !seen.insert(**seed)) {
        return Err(PlanError::SeedTwice(*seed));
    }
    if trees == 0 {
        return Err(PlanError::NoTrees);
    }
    check_records((seeds.len() as u64).saturating_mul(u64::from(trees)))
}

/// Checks the number of records of a task, before any is made.
///
/// # Errors
/// More than [`MOST_RECORDS`].
pub fn check_records(count: u64) -> Result<(), PlanError> {
    if count <= MOST_RECORDS { Ok(()) } else { Err(PlanError::TooMany(count)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_and_trees_are_checked() {
        let check = |seeds: &[u64], trees| check_trees(seeds, trees).map_err(|e| e.to_string());
        assert_eq!(check(&[4, 5], 1), Ok(()));
        assert_eq!(check(&[], 1), Err("no seed given".into()));
        assert_eq!(check(&[4, 5, 4], 1), Err("seed 4 is given twice".into()));
        assert_eq!(check(&[4, 5], 50_000), Ok(()));
        let e = "conditions x seeds x trees x repeats give 100002 records; a task has at most 100000";
        assert_eq!(check(&[4, 5], 50_001), Err(e.into()));
        assert!(check(&[4, 5], u32::MAX).is_err());
        assert_eq!(check(&[4], 0), Err("0 trees: at least 1 tree per seed is needed".into()));
    }
}
