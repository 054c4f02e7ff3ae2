//! Branch unions: weaker than the branch's section where two stems are nearly equal.

use super::fixture::{GRAVITY, Wood, chain, empty};
use orchard_geometry::Vec3;
use orchard_multibody::equilibrium;
use orchard_quantity::from_toml;
use orchard_spec::Spec;
use orchard_spec::wood::{UnionSpec, WoodSpec};
use orchard_treephys::section;

fn wood() -> WoodSpec {
    let text = "codominant = { value = 0.7, range = [0, 1], unit = '1', source = 'x' }\n\
                equal_stems = { value = 0.74, range = [0, 1], unit = '1', source = 'x' }";
    let union: UnionSpec = from_toml("x", text).unwrap();
    WoodSpec { union: Some(union), ..Spec::paper().wood }
}

/// A trunk with a thin and a thick limb, of 0.3 and 0.85 of its diameter: segments 1 and 2.
fn tree(wood: WoodSpec) -> Wood {
    let mut skeleton = empty();
    chain(&mut skeleton, None, Vec3::zeros(), Vec3::z(), 1, 1.0, 0.04);
    chain(&mut skeleton, Some(0), Vec3::z(), Vec3::x(), 1, 0.5, 0.012);
    chain(&mut skeleton, Some(0), Vec3::z(), Vec3::y(), 1, 0.5, 0.034);
    Wood::new(&skeleton, wood)
}

#[test]
fn only_nearly_equal_stems_break_at_the_union() {
    let (with, without) = (tree(wood()), tree(Spec::paper().wood));
    assert_eq!(with.tree.union_fails, [false, false, true]);
    assert_eq!(without.tree.union_fails, [false, false, false]);
    let stress = Spec::paper().wood.rupture_stress.si();
    let section = |radius| section::rupture_moment(stress, radius);
    assert_eq!(with.tree.rupture_moment[..2], [section(0.04), section(0.012)]);
    assert!((with.tree.rupture_moment[2] / section(0.034) - 0.87).abs() < 1e-12);
    assert_eq!(without.tree.rupture_moment[2], section(0.034));
}

/// The thick limb breaks under 0.9 of the moment that its section bears, and without the law it does not.
#[test]
fn a_union_breaks_before_its_section() {
    for (spec, breaks) in [(wood(), true), (Spec::paper().wood, false)] {
        let mut tree = tree(spec);
        let moment = 0.9 * section::rupture_moment(tree.spec.rupture_stress.si(), 0.034);
        tree.settings.gravity = Vec3::zeros();
        for _ in 0..50 {
            tree.load_tip(2, 0.5, Vec3::x() * (moment / 0.5));
            equilibrium(&tree.model, &mut tree.data, &Vec3::zeros(), 1e-9).unwrap();
        }
        let broken: Vec<usize> = (0..4)
            .flat_map(|_| {
                tree.rupture.end_frame(&tree.tree, &tree.model, &mut tree.data, &tree.spec, GRAVITY)
            })
            .collect();
        assert_eq!(broken, if breaks { vec![2] } else { vec![] });
    }
}
