//! Trained systems over 300 seeds: sound trees of bounded size in the form that their descriptions state.

use super::common::sound;

use orchard_geometry::math;
use orchard_spec::tree::{Grammar, UprightsSpec, VTrellisSpec};
use orchard_spec::{Preset, Purpose, Spec, Stream};
use orchard_treegen::grammar::{central_leader::CentralLeader, uprights::Uprights, v_trellis::VTrellis};
use orchard_treegen::lsystem::{self, Module, derive};
use orchard_treegen::{Segment, Skeleton, grow};
use sound::{ROUNDING, assert_sound};

const TRAINED: [Preset; 3] = [Preset::TallSpindle, Preset::VTrellis, Preset::VerticalUfo];

fn trees(spec: &Spec) -> Vec<Skeleton> {
    (0..300).map(|world| grow(spec, 17, world).unwrap()).collect()
}

/// The segments of an order that grow from wood of the order below.
fn bases(tree: &Skeleton, order: u8) -> impl Iterator<Item = &Segment> {
    let from_below = move |s: &&Segment| {
        s.order == order && s.parent.is_some_and(|parent| tree.segments[parent].order + 1 == order)
    };
    tree.segments.iter().filter(from_below)
}

fn v_trellis(spec: &Spec) -> &VTrellisSpec {
    match &spec.tree.grammar {
        Grammar::VTrellis(grammar) => grammar,
        other => panic!("another grammar: {other:?}"),
    }
}

fn uprights(spec: &Spec) -> &UprightsSpec {
    match &spec.tree.grammar {
        Grammar::Uprights(grammar) => grammar,
        other => panic!("another grammar: {other:?}"),
    }
}

#[test]
fn trained_trees_are_sound_and_of_bounded_size() {
    for preset in TRAINED {
        let spec = Spec::preset(preset);
        let mut counts = Vec::new();
        let mut sites = Vec::new();
        for tree in trees(&spec) {
            assert_sound(&spec, &tree);
            counts.push(tree.segments.len());
            sites.push(tree.fruit_sites.len());
        }
        counts.sort_unstable();
        sites.sort_unstable();
        // About 100 to 250; a UFO of six uprights on which two buds abort has the fewest.
        assert!(counts[0] >= 80 && counts[299] <= 250, "{preset}: {} {}", counts[0], counts[299]);
        assert!(sites[0] >= 2 * spec.fruit.count.get() as usize, "{preset}: {sites:?}");
    }
}

#[test]
fn no_apex_is_left() {
    fn finished(mut grammar: impl lsystem::Grammar) -> bool {
        let derivations = grammar.derivations();
        derive(&mut grammar, derivations).iter().all(|module| matches!(module, Module::Turtle(_)))
    }
    for preset in TRAINED {
        let spec = Spec::preset(preset);
        for world in 0..300 {
            let stream = Stream::new(5, world, Purpose::Growth);
            assert!(match &spec.tree.grammar {
                Grammar::CentralLeader(grammar) => finished(CentralLeader::new(grammar, stream)),
                Grammar::VTrellis(grammar) => finished(VTrellis::new(grammar, stream)),
                Grammar::Uprights(grammar) => finished(Uprights::new(grammar, stream)),
                other => panic!("another grammar: {other:?}"),
            });
        }
    }
}

/// Neighbours stand 3-4 ft apart: the laterals of a tall spindle reach half of that, or a little more.
#[test]
fn a_tall_spindle_is_slender_and_its_laterals_hang() {
    let spec = Spec::preset(Preset::TallSpindle);
    let mut radii = Vec::new();
    let (mut down, mut all) = (0, 0);
    for tree in trees(&spec) {
        radii.push(tree.segments.iter().map(|s| s.p_tip_world().xy().norm()).fold(0.0, f64::max));
        for limb in bases(&tree, 1) {
            let z_base = limb.p_base_world.z;
            let mut tip = limb;
            while let Some(next) =
                tree.segments.iter().find(|s| s.order == 1 && s.p_base_world == tip.p_tip_world())
            {
                tip = next;
            }
            all += 1;
            down += usize::from(tip.p_tip_world().z < z_base);
        }
    }
    radii.sort_by(f64::total_cmp);
    assert!((0.45..=0.75).contains(&radii[150]), "{}", radii[150]);
    assert!(2 * down > all, "{down} of {all}");
}

/// Without strays and bends every leader and arm of a V-trellis lies in one of the two planes of its wires.
#[test]
fn a_v_trellis_lies_in_its_planes() {
    let paper = Spec::preset(Preset::VTrellis);
    let mut spec = paper.clone();
    let Grammar::VTrellis(still) = &mut spec.tree.grammar else { panic!("another grammar") };
    still.leader_wobble = still.leader_wobble.with_value(0.0).unwrap();
    still.arm_stray = still.arm_stray.with_value(0.0).unwrap();
    still.arm.wobble = still.arm.wobble.with_value(0.0).unwrap();
    still.arm.droop = still.arm.droop.with_ends(0.0, 0.0).unwrap();
    let (sin, cos) = math::sin_cos(v_trellis(&spec).lean.si());
    for tree in trees(&spec) {
        let fork = tree.segments[1].p_tip_world();
        assert!(fork.x.abs() < ROUNDING && fork.y.abs() < ROUNDING);
        let mut sides = [0, 0];
        for segment in tree.segments.iter().filter(|s| (1..=2).contains(&s.order)) {
            let p = segment.p_tip_world() - fork;
            assert!((p.y.abs() * sin - p.z * cos).abs() < ROUNDING, "{p:?}");
            sides[usize::from(p.y > 0.0)] += 1;
        }
        assert!(sides[0] > 20 && sides[1] > 20, "{sides:?}");
        // Arms go both ways along the row.
        assert!(
            bases(&tree, 2).any(|s| s.heading().x > 0.9) && bases(&tree, 2).any(|s| s.heading().x < -0.9)
        );
    }
    // With them the wood stays near the planes: within a hand's breadth.
    let (mut scales, mut worst) = (Vec::new(), 0.0_f64);
    for tree in trees(&paper) {
        let z_fork = tree.segments[1].p_tip_world().z;
        for segment in tree.segments.iter().filter(|s| (1..=2).contains(&s.order)) {
            let p = segment.p_tip_world();
            let off = (p.y.abs() * sin - (p.z - z_fork) * cos).abs();
            worst = worst.max(off);
        }
        // Rescaling to the height leaves the fork where the planes of the wires meet, to the wobble of the leaders and
        // to a spur that stands up beyond them.
        scales.push(z_fork / v_trellis(&paper).fork_height.si());
    }
    scales.sort_by(f64::total_cmp);
    assert!(worst < 0.2, "{worst}");
    assert!(scales[0] > 0.95 && scales[299] < 1.01, "{scales:?}");
}

/// The trunk lies along the lowest wire, straight along the row; the uprights stand on it, in its plane.
#[test]
fn a_ufo_is_a_wall_of_uprights_on_a_level_trunk() {
    let spec = Spec::preset(Preset::VerticalUfo);
    let grammar = uprights(&spec);
    let (height, stray) = (grammar.trunk_height.si(), grammar.upright_stray.si());
    let mut scales = Vec::new();
    for tree in trees(&spec) {
        let trunk: Vec<&Segment> = tree.segments.iter().filter(|s| s.order == 0).collect();
        let bent = 1 + grammar.bend_internodes.get() as usize;
        assert!(trunk.iter().all(|s| s.p_tip_world().y.abs() < ROUNDING));
        let z_trunk = trunk[bent - 1].p_tip_world().z;
        scales.push(z_trunk / height);
        for level in &trunk[bent..] {
            assert!((level.heading().x - 1.0).abs() < ROUNDING);
            assert!((level.p_tip_world().z - z_trunk).abs() < ROUNDING);
        }
        let most = grammar.uprights.high() as usize;
        let count = bases(&tree, 1).count();
        assert!((4..=most).contains(&count), "{count}");
        // Two strays across each other, and the wobble of an internode.
        let lean = 2.0_f64.sqrt() * stray + grammar.upright.wobble.si();
        for upright in tree.segments.iter().filter(|s| s.order == 1) {
            assert!(upright.heading().z >= math::cos(lean) - ROUNDING, "{}", upright.heading().z);
        }
    }
    // The drawn heights are the tree's, up to the uprights that did not reach the topping height and strays.
    scales.sort_by(f64::total_cmp);
    assert!(scales[15] > 0.99 && scales[285] < 1.02, "{:?}", [scales[15], scales[285]]);
}
