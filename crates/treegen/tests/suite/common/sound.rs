//! The invariants that every tree must keep.

#![allow(dead_code, reason = "each test file uses a part")]

use orchard_spec::Spec;
use orchard_treegen::Skeleton;

/// Rounding of a sum of some dozens of lengths of about a metre.
pub const ROUNDING: f64 = 1e-12;

/// As [`assert_sound_wood`], no wood thinner than a tip, and the tree as tall as asked.
pub fn assert_sound(spec: &Spec, tree: &Skeleton) {
    assert_sound_wood(spec, tree);
    let thinnest = spec.tree.tip_radius.si() * (1.0 - ROUNDING);
    assert!(tree.segments.iter().all(|s| s.radius >= thinnest));
    let top = tree.segments.iter().map(|s| s.p_tip_world().z).fold(0.0, f64::max);
    assert!((top - spec.tree.height.si()).abs() <= 10.0 * ROUNDING, "{top}");
}

/// Parents before children, chained end to end, finite, of positive size, tapering, above the clearance; and
/// fruit sites, leaves and spurs are on the wood and finite.
pub fn assert_sound_wood(spec: &Spec, tree: &Skeleton) {
    let clearance = spec.tree.clearance.si();
    for (i, segment) in tree.segments.iter().enumerate() {
        let p_tip = segment.p_tip_world();
        assert!(p_tip.iter().all(|x| x.is_finite()), "segment {i}");
        assert!(segment.length > 5e-4 && segment.radius > 0.0, "segment {i}");
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
    let carried = tree.fruit_sites.iter().map(|site| (site.segment, site.p_segment));
    let carried = carried.chain(tree.spurs.iter().map(|spur| (spur.segment, spur.p_segment)));
    let leaves = tree.leaves.iter().map(|leaf| (leaf.segment, leaf.x_segment_leaf.translation.vector));
    for (segment, p_segment) in carried.chain(leaves) {
        assert!(segment < tree.segments.len() && p_segment.iter().all(|x| x.is_finite()));
    }
    assert!(tree.spurs.iter().all(|s| s.length > 0.0 && (s.heading_segment.norm() - 1.0).abs() < ROUNDING));
    assert!(tree.leaves.iter().all(|leaf| leaf.area() > 0.0 && leaf.area().is_finite()));
}
