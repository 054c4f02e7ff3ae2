//! Fruit sites and leaves for digitised wood, by the rules for grown trees.

use orchard_spec::{Purpose, Spec, Stream};

use crate::{FruitSite, LeafSite, Segment, fruit_sites, leaves};

/// Places fruit sites on digitised wood.
pub fn dress_with_fruit_sites(spec: &Spec, segments: &[Segment]) -> Vec<FruitSite> {
    fruit_sites::fruit_sites(spec, segments)
}

/// Places leaves on digitised wood, drawn for one world of one seed.
pub fn dress_with_leaves(spec: &Spec, segments: &[Segment], seed: u64, world: u32) -> Vec<LeafSite> {
    leaves::leaves(&spec.foliage, segments, Stream::new(seed, world, Purpose::Foliage))
}
