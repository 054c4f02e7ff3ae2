//! Config variants and the invariants that every tree must keep.

mod wood;

pub use wood::{ROUNDING, assert_sound_wood};

use orchard_spec::Spec;
use orchard_spec::tree::{CentralLeaderSpec, Grammar};
use orchard_treegen::Skeleton;

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

/// As [`assert_sound_wood`], no twig thinner than asked, and the tree as tall as asked.
pub fn assert_sound(spec: &Spec, tree: &Skeleton) {
    assert_sound_wood(spec, tree);
    let thin = spec.tree.tip_radius.si() * (1.0 - ROUNDING);
    assert!(tree.segments.iter().all(|segment| segment.radius >= thin));
    let top = tree.segments.iter().map(|segment| segment.p_tip_world().z).fold(0.0, f64::max);
    assert!((top - spec.tree.height.si()).abs() <= 10.0 * ROUNDING, "{top}");
}
