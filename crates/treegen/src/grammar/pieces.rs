//! Shared parts of the stochastic grammars: a branch, a bend with its inverse, a bound on the tree's size.

use crate::lsystem::{Command, Module};
use orchard_spec::Stream;

/// `/(roll) [ &(angle) apex ]`: a branch; the axis keeps the roll.
pub(super) fn branch<A>(roll: f64, angle: f64, apex: A, successor: &mut Vec<Module<A>>) {
    successor.extend([Command::Roll(roll), Command::Push, Command::Pitch(angle)].map(Module::Turtle));
    successor.extend([Module::Apex(apex), Module::Turtle(Command::Pop)]);
}

/// `[ /(roll) &(angle) apex ]`: a branch; the axis does not roll, for branches whose rolls are
/// measured from one plane.
pub(super) fn branch_aside<A>(roll: f64, angle: f64, apex: A, successor: &mut Vec<Module<A>>) {
    successor.extend([Command::Push, Command::Roll(roll), Command::Pitch(angle)].map(Module::Turtle));
    successor.extend([Module::Apex(apex), Module::Turtle(Command::Pop)]);
}

/// A bend of random size about a random axis across the heading: `/(p) &(w) /(-p)`, and its inverse.
pub(super) fn wobble(stream: &mut Stream, largest: f64) -> ([Command; 3], [Command; 3]) {
    let phase = stream.uniform(0.0, std::f64::consts::TAU);
    let angle = stream.uniform(0.0, largest);
    let bend = |angle| [Command::Roll(phase), Command::Pitch(angle), Command::Roll(-phase)];
    (bend(angle), bend(-angle))
}

/// One internode that zigzags about the axis: the node bends and bends back.
pub(super) fn wobbling_internode<A>(
    stream: &mut Stream,
    largest: f64,
    length: f64,
    successor: &mut Vec<Module<A>>,
) {
    let (bend, unbend) = wobble(stream, largest);
    successor.extend(bend.map(Module::Turtle));
    successor.push(Module::Turtle(Command::Forward(length)));
    successor.extend(unbend.map(Module::Turtle));
}

/// Counts the internodes drawn and those reserved by growing axes.
#[derive(Debug, Clone)]
pub(super) struct Bound {
    committed: u32,
    most: u32,
}

impl Bound {
    pub fn new(most: u32) -> Self {
        Self { committed: 0, most }
    }

    /// Reserves the internodes of a new axis, if the bound on the tree's size allows them.
    pub fn commit(&mut self, internodes: u32) -> bool {
        let fits = self.committed + internodes <= self.most;
        self.committed += if fits { internodes } else { 0 };
        fits
    }
}
