//! The invariants that every tree must keep.

use orchard_spec::Spec;
use orchard_treegen::Skeleton;

/// Rounding of a sum of some dozens of lengths of about a metre.
pub const ROUNDING: f64 = 1e-12;

/// Parents before children, chained end to end, finite, of positive size, tapering, above the clearance, as
/// tall as asked.
pub fn assert_sound(spec: &Spec, tree: &Skeleton) {
    let clearance = spec.tree.clearance.si();
    let mut top = 0.0_f64;
    for (i, segment) in tree.segments.iter().enumerate() {
        let p_tip = segment.p_tip_world();
        assert!(p_tip.iter().all(|x| x.is_finite()), "segment {i}");
        assert!(segment.length > 1e-3 && segment.radius >= spec.tree.tip_radius.si() * (1.0 - ROUNDING));
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
        top = top.max(p_tip.z);
    }
    assert!((top - spec.tree.height.si()).abs() <= 10.0 * ROUNDING, "{top}");
}
