//! Config variants, and the invariants that every tree must keep.

pub mod sound;

use orchard_spec::Spec;
use orchard_spec::tree::{CentralLeaderSpec, Grammar};

/// The preset `paper` with one constant replaced.
pub fn paper_with(table: &str, key: &str, value: &str) -> Result<Spec, String> {
    let text = format!("preset = 'test'\nbase = 'paper'\n[{table}]\n{key} = {value}\n");
    Spec::from_toml("test.toml", &text).map_err(|e| e.to_string())
}

/// The parameters of the central-leader grammar.
pub fn central_leader(spec: &mut Spec) -> &mut CentralLeaderSpec {
    match &mut spec.tree.grammar {
        Grammar::CentralLeader(grammar) => grammar,
        other => panic!("another grammar: {other:?}"),
    }
}
