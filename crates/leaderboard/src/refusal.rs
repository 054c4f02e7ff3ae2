//! Why a result is not taken.

use orchard_bench::store::StoreError;
use orchard_bench::{Missing, RunError};
use orchard_tasks::harvest::command_log::CommandLogError;

use crate::difference::Difference;

/// Reason why a result is refused; displayed in one line.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// No result folder.
    #[error("{file}: {problem}; a result folder of a harvest that ended is needed")]
    NotAResult {
        /// The file that was looked for.
        file: String,
        /// Problem with it.
        problem: String,
    },
    /// Another version than that of this build.
    #[error(
        "{file}: {what} {found}, but this build has {own}: results are verified by the build that made them"
    )]
    Version {
        /// File with the version.
        file: String,
        /// Kind of version.
        what: &'static str,
        /// Value in the result.
        found: String,
        /// Value of this build.
        own: String,
    },
    /// Other seeds than those of the board.
    #[error("summary.json: seed set {found}, but the board is of {own}")]
    Seeds {
        /// Value in the result.
        found: String,
        /// Value of the board.
        own: String,
    },
    /// Another plan.
    #[error("summary.json: {what} {found}, but the official matrix has {own}")]
    Plan {
        /// Name of the figure.
        what: &'static str,
        /// Value in the result.
        found: String,
        /// Value of the official plan.
        own: String,
    },
    /// Episodes of the matrix are not there, or not as this code writes them.
    #[error(transparent)]
    Missing(#[from] Missing),
    /// A record that is not part of the matrix.
    #[error("{file} is not of the official matrix: a submission holds that and nothing else")]
    Surplus {
        /// The file.
        file: String,
    },
    /// A record that contradicts itself.
    #[error("{file} contradicts itself: {problem}")]
    Contradiction {
        /// The file.
        file: String,
        /// Contradiction.
        problem: String,
    },
    /// A command log that cannot be read, or is not the one of its record.
    #[error(transparent)]
    Commands(#[from] CommandLogError),
    /// A summary that does not follow from its records.
    #[error("summary.json is not what its records give: {difference}")]
    Summary {
        /// The first difference.
        difference: Difference,
    },
    /// An episode that has other bytes when run again.
    #[error("{file} comes out otherwise when run again: {difference}")]
    NotRepeated {
        /// The file.
        file: String,
        /// The first difference.
        difference: Difference,
    },
    /// A record of another tree than its key names.
    #[error("{file} is not of the tree of its seed: {difference}")]
    OtherTree {
        /// The file.
        file: String,
        /// The first difference.
        difference: Difference,
    },
    /// No nominal figure to rank by.
    #[error("the nominal condition gives no {metric}: there is nothing to rank")]
    NothingToRank {
        /// The metric.
        metric: &'static str,
    },
    /// The stop flag was raised.
    #[error("interrupted: the board is as it was; the same command goes on from there")]
    Interrupted,
    /// Threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The episodes cannot be run again.
    #[error("cannot run the episodes again: {0}")]
    Run(RunError),
    /// The folder cannot be opened.
    #[error(transparent)]
    Store(#[from] StoreError),
}
