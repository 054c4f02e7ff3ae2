//! Reasons for refusing a result.

use orchard_bench::Missing;
use orchard_bench::store::StoreError;

use crate::difference::Difference;

/// Reason why a result is refused; displayed in one line.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// No result folder.
    #[error("{file}: {problem}; the folder of a completed harvest run is needed")]
    NotAResult {
        /// The missing or unreadable file.
        file: String,
        /// Problem with it.
        problem: String,
    },
    /// Another version than that of this build.
    #[error(
        "{file}: {what} {found}, but this build has {own}: a result can only be verified by the build that made it"
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
    #[error("summary.json: seed set {found}, but the board has {own}")]
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
    /// Episodes of the matrix are missing, or not as this code writes them.
    #[error(transparent)]
    Missing(#[from] Missing),
    /// A record that is not part of the matrix.
    #[error("{file} is not part of the official matrix: a submission may hold no other records")]
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
    /// A summary that does not follow from its records.
    #[error("summary.json does not follow from its records: {difference}")]
    Summary {
        /// The first difference.
        difference: Difference,
    },
    /// An episode that has different bytes when run again.
    #[error("{file} differs when run again: {difference}")]
    NotRepeated {
        /// The file.
        file: String,
        /// The first difference.
        difference: Difference,
    },
    /// A metric that ranking needs is undefined.
    #[error("{metric} is undefined under the nominal condition: the result cannot be ranked")]
    NothingToRank {
        /// The metric.
        metric: &'static str,
    },
    /// The stop flag was raised.
    #[error("interrupted: the board is unchanged")]
    Interrupted,
    /// Threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The folder cannot be opened.
    #[error(transparent)]
    Store(#[from] StoreError),
}
