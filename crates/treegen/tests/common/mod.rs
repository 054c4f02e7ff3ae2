//! Config variants and the invariants that every tree must keep.

use orchard_spec::Spec;
use orchard_spec::tree::{CentralLeaderSpec, Grammar};
use orchard_treegen::Skeleton;

/// Rounding of a sum of some dozens of lengths of about a metre.
pub const ROUNDING: f64 = 1e-12;

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

/// As tall as asked, no wood thinner than a tip, and what [`assert_well_built`] asks.
pub fn assert_sound(spec: &Spec, tree: &Skeleton) {
    assert_well_built(spec, tree);
    let thinnest = spec.tree.tip_radius.si() * (1.0 - ROUNDING);
    assert!(tree.segments.iter().all(|s| s.radius >= thinnest));
    let top = tree.segments.iter().map(|s| s.p_tip_world().z).fold(0.0, f64::max);
    assert!((top - spec.tree.height.si()).abs() <= 10.0 * ROUNDING, "{top}");
}

/// Parents before children, chained end to end, finite, of positive size, tapering, above the clearance.
pub fn assert_well_built(spec: &Spec, tree: &Skeleton) {
    let clearance = spec.tree.clearance.si();
    for (i, segment) in tree.segments.iter().enumerate() {
        let p_tip = segment.p_tip_world();
        assert!(p_tip.iter().all(|x| x.is_finite()), "segment {i}");
        assert!(segment.length > 1e-3 && segment.radius > 1e-4, "segment {i}");
        match segment.parent {
            Some(parent) => {
                assert!(parent < i);
                let parent = &tree.segments[parent];
                assert!((segment.p_base_world - parent.p_tip_world()).norm() <= ROUNDING, "segment {i}");
                assert!(segment.radius <= parent.radius, "segment {i}");
                assert!(segment.order == parent.order || segment.order == parent.order + 1);
                // No twist: the rotation from the parent's frame has its axis across the heading.
                let turn = parent.r_world_segment.inverse() * segment.r_world_segment;
                assert!(turn.k.abs() < ROUNDING, "segment {i}");
            }
            None => assert!(i == 0 && segment.p_base_world.norm() == 0.0),
        }
        if segment.order > 0 {
            let lowest = segment.p_base_world.z.min(p_tip.z) - segment.radius;
            assert!(lowest >= clearance - ROUNDING, "segment {i}: {lowest}");
        }
    }
}
