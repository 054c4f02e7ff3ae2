//! Invariants of default trees, over 300 seeds.

use super::common;

use common::sound::{ROUNDING, assert_sound};
use common::{central_leader, paper_with};
use orchard_geometry::{math, transform};
use orchard_spec::Spec;
use orchard_treegen::{Skeleton, grow};

const SEED: u64 = 11;

fn default_trees(spec: &Spec) -> Vec<Skeleton> {
    (0..300).map(|world| grow(spec, SEED, world).unwrap()).collect()
}

#[test]
fn trees_are_sound_and_of_bounded_size() {
    let spec = Spec::paper();
    let mut counts = Vec::new();
    for tree in default_trees(&spec) {
        assert_sound(&spec, &tree);
        counts.push(tree.segments.len());
    }
    counts.sort_unstable();
    assert!(counts[0] > 60 && counts[counts.len() - 1] < 320, "{counts:?}");
    assert!((130..=190).contains(&counts[counts.len() / 2]), "{counts:?}");
}

/// `r_parent^beta - sum r_child^beta` is one and the same p >= 0 at every internode with children.
#[test]
fn pipe_law_holds_with_one_trunk_term() {
    let spec = Spec::paper();
    let (beta, tip) = (spec.tree.pipe_exponent.si(), spec.tree.tip_radius.si());
    for tree in default_trees(&spec) {
        let power: Vec<f64> = tree.segments.iter().map(|s| math::pow(s.radius, beta)).collect();
        let children = tree.children();
        let term = |i: usize| power[i] - children[i].iter().map(|&c| power[c]).sum::<f64>();
        let trunk_term = term(0);
        assert!(trunk_term >= 0.0);
        assert!((tree.segments[0].radius / spec.tree.trunk_radius.si() - 1.0).abs() < ROUNDING);
        for (i, children) in children.iter().enumerate() {
            if children.is_empty() {
                assert!((tree.segments[i].radius / tip - 1.0).abs() < ROUNDING);
            } else {
                // The law is met to 1e-12 of its largest term; p is read off the trunk, so its error is
                // relative to the trunk's.
                assert!((term(i) - trunk_term).abs() < ROUNDING * power[0], "segment {i}");
            }
        }
    }
}

#[test]
fn same_seed_same_bytes_other_world_other_topology() {
    let spec = Spec::paper();
    // Debug text differs for any two f64 that differ in a bit, also for the two zeros.
    let text = |seed, world| format!("{:?}", grow(&spec, seed, world).unwrap());
    assert_eq!(text(SEED, 3), text(SEED, 3));
    assert_ne!(text(SEED, 3), text(SEED + 1, 3));

    let parents = |tree: &Skeleton| tree.segments.iter().map(|s| s.parent).collect::<Vec<_>>();
    let mut topologies: Vec<_> = default_trees(&spec).iter().map(parents).collect();
    topologies.sort();
    topologies.dedup();
    assert_eq!(topologies.len(), 300);
}

/// Without wobble and droop, and with nothing low enough to be lifted, the angles are the drawn ones.
#[test]
fn branching_angles_are_the_configured_ones() {
    let still = "{ low = 0, high = 0, range = [0, 1], unit = 'deg', source = 'x' }";
    let mut spec = paper_with("tree.grammar.central-leader", "droop", still).unwrap();
    let mut without_wobble = paper_with("tree.grammar.central-leader", "wobble", still).unwrap();
    central_leader(&mut spec).wobble = central_leader(&mut without_wobble).wobble.clone();
    spec.tree.clearance = spec.tree.clearance.with_value(0.0).unwrap();
    let grammar = central_leader(&mut spec).clone();
    for tree in default_trees(&spec) {
        let limbs = tree
            .segments
            .iter()
            .filter(|s| s.order == 1 && s.parent.is_some_and(|parent| tree.segments[parent].order == 0));
        let (least, most) = (grammar.scaffolds.low() as usize, grammar.limbs.high() as usize);
        assert!((least..=most).contains(&limbs.count()));
        for segment in &tree.segments {
            let Some(parent) = segment.parent.map(|parent| &tree.segments[parent]) else { continue };
            if segment.order == parent.order || segment.p_tip_world().z < 0.2 {
                continue;
            }
            let angles = if parent.order == 0 { &grammar.crotch_angle } else { &grammar.lateral_angle };
            let (low, high) = angles.si();
            let cosine = segment.heading().dot(&parent.heading());
            assert!(cosine <= math::cos(low) + ROUNDING && cosine >= math::cos(high) - ROUNDING);
        }
    }
}

#[test]
fn fruit_sites_stand_on_the_bark_of_outer_spurs() {
    let spec = Spec::paper();
    let mut totals = Vec::new();
    for tree in default_trees(&spec) {
        for site in &tree.fruit_sites {
            let segment = &tree.segments[site.segment];
            assert!(segment.order >= 2 && segment.radius < 0.020);
            assert!((0.0..=1.0).contains(&site.outerness));
            assert!(site.p_segment.z > 0.0 && site.p_segment.z <= segment.length);
            let (across, p_axis) = (site.p_segment.xy().norm(), segment.heading() * site.p_segment.z);
            assert!(across == 0.0 || (across - segment.radius).abs() < ROUNDING);
            let p_world = transform(&segment.x_world_segment(), &site.p_segment);
            assert!(p_world.z <= (segment.p_base_world + p_axis).z + ROUNDING, "not on the underside");
        }
        totals.push(tree.fruit_sites.len());
    }
    totals.sort_unstable();
    assert!(totals[0] >= 40, "{totals:?}");
}

#[test]
fn leaves_follow_the_dial() {
    // d -> (leaves an internode, lowest order): round(2 + 3 d), order 3, or 2 above d = 1; none at 0.
    for (dial, per_internode, order) in
        [(0.0, 0, 3), (0.3, 3, 3), (0.6, 4, 3), (1.0, 5, 3), (1.5, 7, 2), (3.0, 11, 2)]
    {
        let mut spec = Spec::paper();
        spec.foliage.density = spec.foliage.density.with_value(dial).unwrap();
        for world in 0..20 {
            let tree = grow(&spec, SEED, world).unwrap();
            let bearing = tree.segments.iter().filter(|s| s.order >= order).count();
            assert_eq!(tree.leaves.len(), bearing * per_internode, "dial {dial}");
            for leaf in &tree.leaves {
                let segment = &tree.segments[leaf.segment];
                let scale = [0.8, 1.0, 1.2][usize::from(leaf.size_class)];
                assert!((leaf.length / scale - (0.065 + 0.033 * dial)).abs() < ROUNDING);
                assert!((leaf.width / scale - (0.038 + 0.020 * dial)).abs() < ROUNDING);
                let normal_world =
                    segment.r_world_segment * leaf.x_segment_leaf.rotation * orchard_geometry::Vec3::z();
                assert!(normal_world.z > -ROUNDING, "a blade shows its lower face to the sky");
            }
        }
    }
}

/// Drawing leaves never shifts the wood.
#[test]
fn foliage_leaves_the_wood_alone() {
    let mut spec = Spec::paper();
    let wood = grow(&spec, SEED, 0).unwrap().segments;
    spec.foliage.density = spec.foliage.density.with_value(1.5).unwrap();
    assert_eq!(grow(&spec, SEED, 0).unwrap().segments, wood);
}
