//! Apple trees grown by parametric L-systems.
//!
//! [`grow`] makes a [`Skeleton`] in steps: config and seed -> [`grammar`] -> [`turtle`] -> pipe model -> height and clearance ->
//! fruit sites and leaves. [`reshape`] gives it another [`Habit`]. The same config, seed and world give the same bytes.
//! Equations: `docs/computation/growth.md`.

pub mod calibration;
pub mod grammar;
pub mod growth;
pub mod lsystem;
pub mod morphometry;
pub mod turtle;

mod assemble;
mod clearance;
mod dress;
mod error;
mod fruit_sites;
mod habit;
mod leaves;
mod links;
mod pipe;
mod radii;
mod segment_map;
mod skeleton;

use orchard_spec::{Purpose, Spec, Stream, tree::Grammar};

pub use assemble::segments;
pub use dress::{dress_with_fruit_sites, dress_with_leaves};
pub use error::TreegenError;
pub use fruit_sites::underside;
pub use growth::{Growth, GrowthUnit};
pub use habit::{Habit, reshape};
pub use segment_map::map_point;
pub use skeleton::{FruitSite, LeafSite, Segment, Skeleton, Spur};

use turtle::Internode;

/// Grows the tree of one world of one seed with the grammar that `spec.tree` chooses.
///
/// # Errors
/// The spec describes a tree that cannot have both its clearance and its height.
pub fn grow(spec: &Spec, seed: u64, world: u32) -> Result<Skeleton, TreegenError> {
    grow_with_units(spec, seed, world).map(|growth| growth.skeleton)
}

/// Grows the same tree as [`grow`], with its growth units; grammars without growth units return none.
///
/// # Errors
/// As [`grow`].
pub fn grow_with_units(spec: &Spec, seed: u64, world: u32) -> Result<Growth, TreegenError> {
    match &spec.tree.grammar {
        Grammar::AnnualShoots(grammar) => growth::grow(spec, grammar, seed, world),
        grammar => {
            let internodes = grammar::draw(grammar, Stream::new(seed, world, Purpose::Growth));
            let skeleton = finish(spec, internodes, Stream::new(seed, world, Purpose::Foliage))?;
            Ok(Growth { skeleton, units: Vec::new() })
        }
    }
}

/// Computes radii first (they depend on topology only), then height and clearance, then fruit sites and leaves.
fn finish(spec: &Spec, mut internodes: Vec<Internode>, foliage: Stream) -> Result<Skeleton, TreegenError> {
    let tree = &spec.tree;
    let parents: Vec<Option<usize>> = internodes.iter().map(|internode| internode.parent).collect();
    let radii = pipe::radii(
        &parents,
        |_, has_children| f64::from(u8::from(has_children)),
        tree.tip_radius.si(),
        tree.trunk_radius.si(),
        tree.pipe_exponent.si(),
    );
    clearance::fit_height_and_clearance(&mut internodes, &radii, tree.height.si(), tree.clearance.si())?;
    let segments = assemble::segments(&internodes, &radii);
    let fruit_sites = fruit_sites::fruit_sites(spec, &segments);
    let leaves = leaves::leaves(&spec.foliage, &segments, foliage);
    Ok(Skeleton { segments, fruit_sites, leaves, spurs: Vec::new() })
}
