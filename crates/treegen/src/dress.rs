//! Fruit sites and leaves for wood that did not grow here, by the rules of the trees that did.

use orchard_spec::{Purpose, Spec, Stream};

use crate::{FruitSite, LeafSite, Segment, fruit_sites, leaves};

/// The places on digitised wood where fruit may hang.
pub fn dress_with_fruit_sites(spec: &Spec, segments: &[Segment]) -> Vec<FruitSite> {
    fruit_sites::fruit_sites(spec, segments)
}

/// Leaves for digitised wood, drawn for one world of one seed.
pub fn dress_with_leaves(spec: &Spec, segments: &[Segment], seed: u64, world: u32) -> Vec<LeafSite> {
    leaves::leaves(&spec.foliage, segments, Stream::new(seed, world, Purpose::Foliage))
}
