//! Apple trees grown by parametric L-systems.
//!
//! config + seed -> [`grammar`] -> [`turtle`] -> pipe model -> height and clearance -> [`Skeleton`] with fruit
//! sites and leaves. Same config, seed and world: same bytes. `docs/computation/growth.md` derives it.

pub mod grammar;
pub mod lsystem;
pub mod turtle;

mod assemble;
mod clearance;
mod dress;
mod error;
mod fruit_sites;
mod leaves;
mod pipe;
mod skeleton;

use orchard_spec::{Purpose, Spec, Stream, tree::GrammarKind};

pub use assemble::segments;
pub use dress::{dress_with_fruit_sites, dress_with_leaves};
pub use error::TreegenError;
pub use skeleton::{FruitSite, LeafSite, Segment, Skeleton};

use grammar::{central_leader::CentralLeader, ternary::Ternary};
use turtle::Internode;

/// Grows the tree of one world of one seed with the grammar that `spec.tree` names.
///
/// # Errors
/// The spec describes a tree that cannot keep its clearance at its height.
pub fn grow(spec: &Spec, seed: u64, world: u32) -> Result<Skeleton, TreegenError> {
    let internodes = match spec.tree.grammar {
        GrammarKind::Ternary => ternary(spec, spec.tree.ternary.derivations.get()),
        GrammarKind::CentralLeader => {
            let stream = Stream::new(seed, world, Purpose::Growth);
            let mut grammar = CentralLeader::new(&spec.tree.central_leader, stream);
            let derivations = grammar.derivations();
            turtle::interpret(&lsystem::derive(&mut grammar, derivations))
        }
    };
    finish(spec, internodes, Stream::new(seed, world, Purpose::Foliage))
}

/// Grows the canonical ternary tree: `1 + 2 (3^derivations - 1)` segments. Its wood needs no random number;
/// its leaves are those of seed 0, world 0.
///
/// # Errors
/// As [`grow`]; more derivations than `spec.tree.ternary.derivations` allows.
pub fn grow_ternary(spec: &Spec, derivations: u32) -> Result<Skeleton, TreegenError> {
    let derivations =
        spec.tree.ternary.derivations.with_value(derivations).map_err(TreegenError::Derivations)?.get();
    finish(spec, ternary(spec, derivations), Stream::new(0, 0, Purpose::Foliage))
}

fn ternary(spec: &Spec, derivations: u32) -> Vec<Internode> {
    turtle::interpret(&lsystem::derive(&mut Ternary::new(&spec.tree.ternary), derivations))
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
