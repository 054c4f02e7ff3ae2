//! Grammars of apple trees, one file each: productions, and the parameters that a tree draws for them.
//!
//! [`crate::lsystem`] rewrites strings and [`crate::turtle`] interprets them; the config (`orchard_spec::tree`) has the
//! intervals of the parameters. A new grammar is a new file here, a table of parameters there and a line in `draw`.

pub mod annual_shoots;
pub mod central_leader;
pub mod shoot;
pub mod ternary;
pub mod uprights;
pub mod v_trellis;

mod pieces;

use crate::lsystem;
use crate::turtle::{self, Internode};
use annual_shoots::AnnualShoots;
use central_leader::CentralLeader;
use orchard_spec::{Stream, tree::Grammar};
use ternary::Ternary;
use uprights::Uprights;
use v_trellis::VTrellis;

/// Derives the grammar that a config chooses and draws its string.
pub(crate) fn draw(grammar: &Grammar, stream: Stream) -> Vec<Internode> {
    match grammar {
        Grammar::Ternary(spec) => drawn(Ternary::new(spec)),
        Grammar::CentralLeader(spec) => drawn(CentralLeader::new(spec, stream)),
        Grammar::VTrellis(spec) => drawn(VTrellis::new(spec, stream)),
        Grammar::Uprights(spec) => drawn(Uprights::new(spec, stream)),
        Grammar::AnnualShoots(spec) => drawn(AnnualShoots::new(spec, stream)),
    }
}

fn drawn(mut grammar: impl lsystem::Grammar) -> Vec<Internode> {
    let derivations = grammar.derivations();
    turtle::interpret(&lsystem::derive(&mut grammar, derivations))
}
