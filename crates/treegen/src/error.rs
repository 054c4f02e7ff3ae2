//! Errors of growing a tree.

/// Error of a config whose fields are valid one by one but describe no tree.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TreegenError {
    /// A branch starts so low that no rotation raises its lowest point above the clearance.
    #[error(
        "tree.clearance: segment {segment} cannot be raised {clearance} m above the ground on a tree {height} m tall"
    )]
    Clearance {
        /// Index of the segment.
        segment: usize,
        /// Configured clearance \[m\].
        clearance: f64,
        /// Configured height \[m\].
        height: f64,
    },
    /// Lifting low branches and scaling to the height did not converge.
    #[error("tree.height: lifting low branches and scaling to {height} m did not converge")]
    Height {
        /// Configured height \[m\].
        height: f64,
    },
    /// The config's lengths give a tree of too many parts.
    #[error("{field}: {count} {parts} are more than {most}, the most that a tree may have")]
    TooMany {
        /// Field that decides their number.
        field: &'static str,
        /// The parts.
        parts: &'static str,
        /// Their number.
        count: f64,
        /// Largest number.
        most: f64,
    },
    /// The leader makes no shoot.
    #[error(
        "tree.grammar.annual-shoots.leader_shoots: a tree needs a season, and growth_units_max a growth unit"
    )]
    NoShoot,
    /// A figure that thickness is divided or multiplied by is not positive.
    #[error("tree.grammar.annual-shoots.{table}{field}: {value} must be above 0")]
    NotPositive {
        /// The table below the grammar's with a dot, or nothing.
        table: &'static str,
        /// The field.
        field: &'static str,
        /// Value or lower end of the range, SI units.
        value: f64,
    },
}
