//! Why a tree could not be grown.

/// A config that is valid field by field but describes no tree.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TreegenError {
    /// A branch starts so low that no lift brings its lowest point above the clearance.
    #[error(
        "tree.clearance: segment {segment} cannot be brought {clearance} m above the ground on a tree {height} m tall"
    )]
    Clearance {
        /// Index of the segment.
        segment: usize,
        /// Clearance asked for [m].
        clearance: f64,
        /// Height asked for [m].
        height: f64,
    },
    /// Lifting low branches and scaling to the height did not come to rest together.
    #[error("tree.height: lifting low branches and scaling to {height} m do not settle together")]
    Height {
        /// Height asked for [m].
        height: f64,
    },
    /// The leader makes no shoot.
    #[error(
        "tree.grammar.annual-shoots.leader_shoots: a tree needs a season, and growth_units_max a growth unit"
    )]
    NoShoot,
}
