//! Wood that scatters and softens towards the shoots.

use super::fixture::{Wood, chain, empty};
use orchard_geometry::Vec3;
use orchard_multibody::equilibrium;
use orchard_quantity::from_toml;
use orchard_spec::Spec;
use orchard_spec::wood::{ScatterSpec, WoodSpec, YoungWoodSpec};
use orchard_treegen::Skeleton;
use orchard_treephys::Timber;

fn trunk(segments: usize, radius: f64) -> Skeleton {
    let mut skeleton = empty();
    chain(&mut skeleton, None, Vec3::zeros(), Vec3::z(), segments, 0.1, radius);
    skeleton
}

fn scattered() -> WoodSpec {
    let factor = |name: &str, sd: f64| {
        format!(
            "{name} = {{ mean = 1.0, sd = {sd}, low = 0.2, high = 1.8, range = [0, 9], unit = '1', source = 'x' }}\n"
        )
    };
    let text = [
        ("density", 0.04),
        ("modulus_tree", 0.08),
        ("modulus", 0.2),
        ("rupture_tree", 0.09),
        ("rupture", 0.16),
    ]
    .map(|(name, sd)| factor(name, sd))
    .concat();
    let rest_load = "rest_load = { value = 0.8, range = [0.1, 1], unit = '1', source = 'x' }";
    let scatter: ScatterSpec = from_toml("x", &(text + rest_load)).unwrap();
    WoodSpec { scatter: Some(scatter), ..Spec::paper().wood }
}

/// Mean and standard deviation over the mean.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0);
    (mean, variance.sqrt() / mean)
}

/// 400 segments of a tree: the coefficients of variation within 4 standard errors, 1 / sqrt(800) of them.
#[test]
fn segments_scatter_as_asked() {
    let timber = Timber::draw(&trunk(400, 0.02), &scattered(), 1, 0);
    for (values, asked) in
        [(&timber.density, 0.04), (&timber.youngs_modulus, 0.2), (&timber.rupture_stress, 0.16)]
    {
        let (_, cv) = moments(values);
        assert!((cv / asked - 1.0).abs() < 4.0 / 800_f64.sqrt(), "{cv} against {asked}");
    }
}

/// Means of 200 trees of 100 segments scatter by the tree's part and what is left of the segments'.
#[test]
fn trees_scatter_as_asked() {
    let means: Vec<f64> = (0..200)
        .map(|world| moments(&Timber::draw(&trunk(100, 0.02), &scattered(), 1, world).rupture_stress).0)
        .collect();
    let (mean, cv) = moments(&means);
    let asked = (0.09_f64 * 0.09 + 0.16 * 0.16 / 100.0).sqrt();
    assert!((cv / asked - 1.0).abs() < 4.0 / 400_f64.sqrt(), "{cv} against {asked}");
    let whole = Spec::paper().wood.rupture_stress.si();
    assert!((mean / whole - 1.0).abs() < 4.0 * asked / 200_f64.sqrt(), "{mean}");
}

#[test]
fn draws_repeat_and_worlds_differ() {
    let (skeleton, wood) = (trunk(5, 0.02), scattered());
    let draw = |seed, world| Timber::draw(&skeleton, &wood, seed, world);
    assert_eq!(draw(1, 0), draw(1, 0));
    for other in [draw(2, 0), draw(1, 1)] {
        assert_ne!(draw(1, 0).density, other.density);
        assert_ne!(draw(1, 0).youngs_modulus, other.youngs_modulus);
        assert_ne!(draw(1, 0).rupture_stress, other.rupture_stress);
    }
    // Without scatter nothing is drawn.
    let plain = Spec::paper().wood;
    assert_eq!(Timber::draw(&skeleton, &plain, 1, 0), Timber::mean(&skeleton, &plain));
}

#[test]
fn young_wood_is_softer_and_tougher() {
    let text = "youngs_modulus = { value = 1.1, range = [0, 9], unit = 'GPa', source = 'x' }\n\
                rupture_stress = { value = 80, range = [0, 99], unit = 'MPa', source = 'x' }\n\
                diameter = { low = 8, high = 30, range = [0, 99], unit = 'mm', source = 'x' }";
    let young: YoungWoodSpec = from_toml("x", text).unwrap();
    let wood = WoodSpec { young: Some(young), ..Spec::paper().wood };
    let modulus = |diameter: f64| Timber::mean(&trunk(1, 0.5 * diameter), &wood).youngs_modulus[0];
    assert_eq!(modulus(0.004), 1.1e9);
    assert_eq!(modulus(0.008), 1.1e9);
    assert!((modulus(0.019) / (0.5 * (1.1e9 + 7e9)) - 1.0).abs() < 1e-12);
    assert_eq!(modulus(0.030), 7e9);
    assert_eq!(modulus(0.1), 7e9);
    let strength = |diameter: f64| Timber::mean(&trunk(1, 0.5 * diameter), &wood).rupture_stress[0];
    assert_eq!([0.008, 0.030].map(strength), [80e6, 50e6]);
    assert!((strength(0.019) / 65e6 - 1.0).abs() < 1e-12);
}

/// A limb that bears more than it was drawn for has the strength that it shows, and the others keep theirs.
#[test]
fn a_tree_that_stands_is_no_weaker_than_its_load() {
    let mut skeleton = empty();
    chain(&mut skeleton, None, Vec3::zeros(), Vec3::z(), 1, 1.0, 0.04);
    chain(&mut skeleton, Some(0), Vec3::z(), Vec3::x(), 2, 0.5, 0.012);
    let mut wood = Wood::new(&skeleton, scattered());
    let load = 0.9 * wood.tree.rupture_moment[1] / 0.5;
    wood.load_tip(1, 0.5, Vec3::new(0.0, 0.0, -load));
    equilibrium(&wood.model, &mut wood.data, &Vec3::zeros(), 1e-9).unwrap();
    let drawn = wood.tree.rupture_moment.clone();
    let Wood { tree, model, data, spec, .. } = &mut wood;
    let moment = tree.stiffness[1] * tree.bending_angle(model, data, 1);
    assert!(moment > 0.8 * drawn[1] && moment < drawn[1], "{moment} of {}", drawn[1]);
    tree.strengthen_to_stand(model, data, spec);
    assert_eq!(tree.rupture_moment, [drawn[0], moment / 0.8, drawn[2]]);
    spec.scatter = None;
    tree.rupture_moment.clone_from(&drawn);
    tree.strengthen_to_stand(model, data, spec);
    assert_eq!(tree.rupture_moment, drawn);
}
