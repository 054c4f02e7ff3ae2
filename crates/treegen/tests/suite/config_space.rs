//! The ternary tree, and trees all over the config's space: sound, or an error in words; never a panic.

use super::common;

use common::{central_leader, paper_with, sound::assert_sound};
use orchard_spec::Spec;
use orchard_treegen::{TreegenError, grow};
use proptest::prelude::*;

/// The canonical tree of some derivations.
fn ternary_spec(derivations: u32) -> Result<Spec, String> {
    let text = format!(
        "preset = 'test'\nbase = 'ternary'\n[tree.grammar.ternary]\n\
         derivations = {{ value = {derivations}, range = [0, 8], unit = 'derivations', source = 'x' }}"
    );
    Spec::from_toml("test.toml", &text).map_err(|e| e.to_string())
}

#[test]
fn ternary_tree_has_its_exact_count() {
    let mut power = 1;
    for n in 1..=6 {
        power *= 3;
        let spec = ternary_spec(n).unwrap();
        let tree = grow(&spec, 0, 0).unwrap();
        assert_eq!(tree.segments.len(), 1 + 2 * (power - 1));
        assert_sound(&spec, &tree);
    }
}

#[test]
fn a_grammar_that_is_not_there_is_an_error() {
    let e = paper_with("tree.grammar.quaternary", "n", "4").unwrap_err();
    assert!(e.starts_with("test.toml: tree.grammar") && e.contains("central-leader"), "{e}");
}

#[test]
fn too_many_derivations_is_an_error() {
    let e = ternary_spec(30).unwrap_err();
    assert_eq!(
        e,
        "test.toml: tree.grammar.ternary.derivations: 30 is outside the allowed range [0, 8] derivations"
    );
}

#[test]
fn a_tree_too_small_for_its_clearance_is_an_error() {
    let mut spec = Spec::paper();
    spec.tree.height = spec.tree.height.with_value(0.3).unwrap();
    assert!(matches!(grow(&spec, 0, 0), Err(TreegenError::Clearance { .. })));
}

#[test]
fn count_spans_are_checked() {
    for (value, problem) in [
        ("{ low = 3, high = 60, range = [1, 12], unit = 'limbs', source = 'x' }", "60 is outside"),
        ("{ low = 5, high = 4, range = [1, 12], unit = 'limbs', source = 'x' }", "low 5 is above high 4"),
        ("{ low = 2.5, high = 4, range = [1, 12], unit = 'limbs', source = 'x' }", "expected u32"),
    ] {
        let e = paper_with("tree.grammar.central-leader", "scaffolds", value).unwrap_err();
        assert!(
            e.starts_with("test.toml: tree.grammar.central-leader.scaffolds") && e.contains(problem),
            "{e}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// Weeping trees of any height: heavy droop forces the clearance pass to work.
    #[test]
    fn weeping_trees_are_sound(
        world in 0_u32..10_000, height in 1.5..6.0_f64, clearance in 0.0..0.3_f64, droop in 0.0..60.0_f64,
    ) {
        let droop = format!("{{ low = {droop}, high = {droop}, range = [0, 60], unit = 'deg', source = 'x' }}");
        let mut spec = paper_with("tree.grammar.central-leader", "droop", &droop).unwrap();
        spec.tree.height = spec.tree.height.with_value(height).unwrap();
        spec.tree.clearance = spec.tree.clearance.with_value(clearance).unwrap();
        assert_sound(&spec, &grow(&spec, 1, world).unwrap());
    }

    /// Any allowed height, clearance, exponent, radii, orders and size bound.
    #[test]
    fn every_config_gives_a_sound_tree_or_an_error(
        world in 0_u32..10_000, height in 0.2..10.0_f64, clearance in 0.0..1.0_f64, exponent in 1.5..3.5_f64,
        trunk in 1.0..500.0_f64, orders in 1_u32..=6, bound in 50_u32..=5000,
    ) {
        let mut spec = Spec::paper();
        let tree = &mut spec.tree;
        tree.height = tree.height.with_value(height).unwrap();
        tree.clearance = tree.clearance.with_value(clearance).unwrap();
        tree.pipe_exponent = tree.pipe_exponent.with_value(exponent).unwrap();
        tree.trunk_radius = tree.trunk_radius.with_value(trunk).unwrap();
        let grammar = central_leader(&mut spec);
        grammar.branch_orders = grammar.branch_orders.with_value(orders).unwrap();
        grammar.segments_max = grammar.segments_max.with_value(bound).unwrap();
        if let Ok(tree) = grow(&spec, 2, world) {
            prop_assert!(tree.segments.len() <= bound as usize);
            prop_assert!(tree.segments.iter().all(|s| u32::from(s.order) < orders));
            assert_sound(&spec, &tree);
        }
    }

    #[test]
    fn a_value_out_of_range_is_refused(divergence in 361.0..1e9_f64) {
        let value = format!("{{ low = 0, high = {divergence}, range = [0, 360], unit = 'deg', source = 'x' }}");
        let e = paper_with("tree.grammar.central-leader", "divergence", &value).unwrap_err();
        prop_assert!(e.starts_with("test.toml: tree.grammar.central-leader.divergence: "), "{}", e);
    }
}
