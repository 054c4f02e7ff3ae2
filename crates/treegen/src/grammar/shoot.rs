//! Productions of a shoot tied along wires that bears spurs, shared by the trained grammars.

use super::pieces::{Bound, branch, wobble};
use crate::lsystem::{Command, Module};
use orchard_spec::{Stream, tree::ShootSpec};

/// Growing points of a shoot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShootApex {
    /// The tip, about to draw one internode.
    Tip {
        /// Internodes still to draw.
        left: u32,
        /// Length of each \[m\].
        length: f64,
    },
    /// A spur's bud.
    Spur,
}

/// The tip of a shoot of a length \[m\], if the bound on the tree's size allows it.
pub(super) fn open(
    spec: &ShootSpec,
    length: f64,
    stream: &mut Stream,
    bound: &mut Bound,
) -> Option<ShootApex> {
    let internodes = spec.internodes.draw(stream).max(1);
    bound
        .commit(internodes)
        .then(|| ShootApex::Tip { left: internodes, length: length / f64::from(internodes) })
}

/// Number of derivations after which a shoot is complete.
pub(super) fn derivations(spec: &ShootSpec) -> u32 {
    // One derivation an internode; a spur is rewritten together with the next internode.
    spec.internodes.high().max(1)
}

/// Productions of a shoot; `wrap` makes an apex of the grammar from one of the shoot.
///
/// - `Tip(n > 1, l) -> W Droop(g) F(l) W' { /(d) [ &(a) Spur ] } Tip(n - 1, l)`;
/// - `Tip(1, l) -> W Droop(g) F(l) W'`;
/// - `Spur -> Droop(g) F(l)`.
pub(super) fn grow<A>(
    spec: &ShootSpec,
    apex: ShootApex,
    stream: &mut Stream,
    bound: &mut Bound,
    wrap: impl Fn(ShootApex) -> A,
    successor: &mut Vec<Module<A>>,
) {
    match apex {
        ShootApex::Tip { left, length } => {
            let (bend, unbend) = wobble(stream, spec.wobble.si());
            let droop = stream.within(spec.droop.si());
            successor.extend(bend.map(Module::Turtle));
            successor.extend([Command::Droop(droop), Command::Forward(length)].map(Module::Turtle));
            successor.extend(unbend.map(Module::Turtle));
            if left > 1 {
                grow_spurs(spec, stream, bound, &wrap, successor);
                successor.push(Module::Apex(wrap(ShootApex::Tip { left: left - 1, length })));
            }
        }
        ShootApex::Spur => {
            let droop = stream.within(spec.spur_droop.si());
            let length = stream.within(spec.spur_length.si());
            successor.extend([Command::Droop(droop), Command::Forward(length)].map(Module::Turtle));
        }
    }
}

/// The spurs of one node.
fn grow_spurs<A>(
    spec: &ShootSpec,
    stream: &mut Stream,
    bound: &mut Bound,
    wrap: &impl Fn(ShootApex) -> A,
    successor: &mut Vec<Module<A>>,
) {
    for _ in 0..spec.spurs.draw(stream) {
        let divergence = stream.within(spec.divergence.si());
        let angle = stream.within(spec.spur_angle.si());
        if bound.commit(1) {
            branch(divergence, angle, wrap(ShootApex::Spur), successor);
        }
    }
}
