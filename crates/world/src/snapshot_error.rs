//! Errors of snapshots.

use orchard_multibody::StateError;

use crate::identity::Difference;

/// A snapshot that cannot be read, or not be restored into a world.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SnapshotError {
    /// Other first bytes.
    #[error("not a snapshot of a world")]
    NotASnapshot,
    /// Written by newer or older code.
    #[error(
        "{} format of snapshot: version {found}, this code reads version {known}",
        if found > known { "newer" } else { "outdated" }
    )]
    Version {
        /// Version of the bytes.
        found: u32,
        /// Version that this code reads.
        known: u32,
    },
    /// The end is missing.
    #[error("the snapshot is cut off: {found} of {expected} bytes")]
    CutOff {
        /// Bytes that it should have.
        expected: u64,
        /// Bytes that are there.
        found: u64,
    },
    /// Something follows its end.
    #[error("{found} bytes, but the snapshot ends after {expected}")]
    Surplus {
        /// Bytes that it should have.
        expected: u64,
        /// Bytes that are there.
        found: u64,
    },
    /// Some bytes have changed.
    #[error("the snapshot is damaged: its checksum is wrong")]
    Damaged,
    /// Whole, but not what a snapshot holds.
    #[error("the snapshot cannot be decoded: {0}")]
    Unreadable(postcard::Error),
    /// A snapshot of something else.
    #[error("the snapshot belongs to another world: {0}")]
    OtherWorld(#[from] Difference),
    /// Right world, wrong multibody state.
    #[error("the snapshot does not fit its world: {0}")]
    State(#[from] StateError),
    /// Right world, wrong content.
    #[error("the snapshot does not fit its world: wrong {0}")]
    Content(&'static str),
}
