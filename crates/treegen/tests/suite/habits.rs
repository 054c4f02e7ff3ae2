//! Reshaped trees keep the invariants of grown trees, except the height.

#[allow(dead_code, reason = "other suites use the rest")]
use super::common;

use common::sound::{ROUNDING, assert_sound_wood};
use orchard_geometry::{Vec3, transform};
use orchard_spec::{Preset, Purpose, Spec, Stream};
use orchard_treegen::{Habit, LeafSite, Skeleton, grow, reshape};
use proptest::prelude::*;

const SEED: u64 = 19;

/// A habit far beyond those that a config draws at strength 1.
fn wild(n: usize, droop: f64, lean: f64, spread: f64, twist: f64) -> Habit {
    let mut stream = Stream::new(SEED, 0, Purpose::Test);
    Habit {
        length: (0..n).map(|_| stream.uniform(0.6, 1.6)).collect(),
        radius: (0..n).map(|_| stream.uniform(0.6, 1.6)).collect(),
        bend: (0..n)
            .map(|_| (stream.normal(0.0, 0.15), stream.uniform(0.0, std::f64::consts::TAU)))
            .collect(),
        droop,
        lean_world: Vec3::x() * lean,
        fork_spread: spread,
        twist,
    }
}

fn assert_dressed(spec: &Spec, base: &Skeleton, tree: &Skeleton) {
    assert_eq!(tree.leaves.len(), base.leaves.len());
    for (before, leaf) in base.leaves.iter().zip(&tree.leaves) {
        // Distance outside the bark, stretched with the wood.
        let stretch = tree.segments[leaf.segment].length / base.segments[leaf.segment].length;
        let outside = |leaf: &LeafSite, tree: &Skeleton| {
            leaf.x_segment_leaf.translation.vector.xy().norm() - tree.segments[leaf.segment].radius
        };
        assert!((outside(leaf, tree) - stretch * outside(before, base)).abs() < ROUNDING);
        let r_world_leaf = tree.segments[leaf.segment].r_world_segment * leaf.x_segment_leaf.rotation;
        assert!((r_world_leaf * Vec3::z()).z > -ROUNDING, "a blade shows its lower face to the sky");
    }
    assert_eq!(tree.fruit_sites.len(), base.fruit_sites.len());
    let per_segment = spec.tree.fruit_sites.get();
    for (before, site) in base.fruit_sites.iter().zip(&tree.fruit_sites) {
        let (old, segment) = (&base.segments[before.segment], &tree.segments[site.segment]);
        assert_eq!(before.segment, site.segment);
        assert!((0.0..=1.0).contains(&site.outerness));
        let share = site.p_segment.z / segment.length;
        assert!((share - before.p_segment.z / old.length).abs() < ROUNDING);
        assert!((share * f64::from(per_segment)).fract().min(1e-9) < 1e-8);
        let across = site.p_segment.xy().norm();
        assert!(across == 0.0 || (across - segment.radius).abs() < ROUNDING);
        let p_axis = segment.p_base_world + segment.heading() * site.p_segment.z;
        assert!(transform(&segment.x_world_segment(), &site.p_segment).z <= p_axis.z + ROUNDING);
    }
}

/// Without any change the tree is the same to rounding, leaves and sites included.
#[test]
fn a_neutral_habit_changes_nothing() {
    let spec = Spec::paper();
    for world in 0..30 {
        let base = grow(&spec, SEED, world).unwrap();
        let n = base.segments.len();
        let habit = Habit {
            length: vec![1.0; n],
            radius: vec![1.0; n],
            bend: vec![(0.0, 1.0); n],
            ..wild(n, 0.0, 0.0, 1.0, 0.0)
        };
        let same = reshape(&base, &habit, spec.tree.clearance.si()).unwrap();
        for (a, b) in base.segments.iter().zip(&same.segments) {
            assert!((a.p_tip_world() - b.p_tip_world()).norm() < ROUNDING);
            assert_eq!((a.length, a.radius, a.order, a.parent), (b.length, b.radius, b.order, b.parent));
        }
        for (a, b) in base.leaves.iter().zip(&same.leaves) {
            assert!(
                (a.x_segment_leaf.translation.vector - b.x_segment_leaf.translation.vector).norm() < ROUNDING
            );
            // The angle between two all but equal quaternions is known to the root of a rounding.
            assert!(a.x_segment_leaf.rotation.angle_to(&b.x_segment_leaf.rotation) < 1e-7);
            assert_eq!((a.length, a.width, a.segment), (b.length, b.width, b.segment));
        }
        assert_dressed(&spec, &base, &same);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn reshaped_trees_are_well_built(
        world in 0_u32..10_000, droop in -0.1..0.2_f64, lean in 0.0..0.3_f64, spread in 0.5..1.6_f64,
        twist in -1.0..1.0_f64, ternary in any::<bool>(),
    ) {
        let spec = Spec::preset(if ternary { Preset::Ternary } else { Preset::Paper });
        let base = grow(&spec, SEED, world).unwrap();
        let habit = wild(base.segments.len(), droop, lean, spread, twist);
        let tree = reshape(&base, &habit, spec.tree.clearance.si()).unwrap();
        assert_sound_wood(&spec, &tree);
        assert_dressed(&spec, &base, &tree);
        prop_assert_eq!(&tree, &reshape(&base, &habit, spec.tree.clearance.si()).unwrap());
    }
}
