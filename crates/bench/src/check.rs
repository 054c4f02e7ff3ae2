//! Checks of plans that all tasks share.

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
/// No seed, a seed given twice, or no tree.
pub fn check_trees(seeds: &[u64], trees: u32) -> Result<(), PlanError> {
    if seeds.is_empty() {
        return Err(PlanError::NoSeeds);
    }
    for (i, seed) in seeds.iter().enumerate() {
        if seeds[..i].contains(seed) {
            return Err(PlanError::SeedTwice(*seed));
        }
    }
    if trees == 0 { Err(PlanError::NoTrees) } else { Ok(()) }
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
        assert_eq!(check(&[4], 0), Err("0 trees: at least 1 tree per seed is needed".into()));
    }
}
