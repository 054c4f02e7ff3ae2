//! Apple trees grown by parametric L-systems.
//!
//! config + seed -> [`grammar`] -> [`turtle`] -> pipe model -> height and clearance -> [`Skeleton`] with fruit
//! sites and leaves; a [`Habit`] reshapes it. Same config, seed and world: same bytes. `docs/computation/growth.md` derives it.

pub mod grammar;
pub mod lsystem;
pub mod turtle;

mod assemble;
mod carry;
mod clearance;
mod dress;
mod error;
mod fruit_sites;
mod habit;
mod leaves;
mod pipe;
mod skeleton;

use orchard_spec::{Purpose, Spec, Stream};

pub use assemble::segments;
pub use carry::carried_to;
pub use dress::{dress_with_fruit_sites, dress_with_leaves};
pub use error::TreegenError;
pub use habit::{Habit, reshape};
pub use skeleton::{FruitSite, LeafSite, Segment, Skeleton};

use turtle::Internode;

/// Grows the tree of one world of one seed with the grammar that `spec.tree` chooses.
///
/// # Errors
/// The spec describes a tree that cannot keep its clearance at its height.
pub fn grow(spec: &Spec, seed: u64, world: u32) -> Result<Skeleton, TreegenError> {
    let internodes = grammar::draw(&spec.tree.grammar, Stream::new(seed, world, Purpose::Growth));
    finish(spec, internodes, Stream::new(seed, world, Purpose::Foliage))
}

/// Radii first (they depend on topology alone), then height and clearance, then what the wood carries.
fn finish(spec: &Spec, mut internodes: Vec<Internode>, foliage: Stream) -> Result<Skeleton, TreegenError> {
    let tree = &spec.tree;
    let parents: Vec<Option<usize>> = internodes.iter().map(|internode| internode.parent).collect();
    let radii = pipe::radii(&parents, tree.tip_radius.si(), tree.trunk_radius.si(), tree.pipe_exponent.si());
    clearance::stand(&mut internodes, &radii, tree.height.si(), tree.clearance.si())?;
    let segments = assemble::segments(&internodes, &radii);
    let fruit_sites = fruit_sites::fruit_sites(spec, &segments);
    let leaves = leaves::leaves(&spec.foliage, &segments, foliage);
    Ok(Skeleton { segments, fruit_sites, leaves })
}
