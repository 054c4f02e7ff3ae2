//! The simulator's figures of wood, by the names of their rows, in SI units.

use anyhow::Context;
use orchard_geometry::Vec3;
use orchard_spec::wood::{JointLaw, WoodSpec};
use orchard_spec::{Preset, Spec};
use orchard_treegen::{Skeleton, grow};
use orchard_treephys::trials::{
    Trial, elastica_tip, radius_of_frequency, scaled, straight_limb, sway_frequency, trunk_and_limb,
};
use orchard_treephys::{Timber, section};

use crate::bare_tree::BareTree;

/// Seed of the trees; tree i is its world i.
const SEED: u64 = 1;

/// Trees whose material is averaged.
const TREES: u32 = 20;

/// Length of straight limbs \[m\].
const LENGTH: f64 = 1.0;

/// Slope at the tip of small loads \[rad\].
const SLOPE: f64 = 1e-4;

/// A figure by its row's name.
pub fn figure(name: &str) -> anyhow::Result<f64> {
    let spec = Spec::preset(Preset::MeasuredWood);
    let wood = &spec.wood;
    match name {
        "density" => material(|timber, _| Some(mean(timber.density.iter().copied()))),
        "modulus" => {
            material(|timber, tree| mean_where(&timber.youngs_modulus, tree, |d| d >= diameters(wood).1))
        }
        "young_modulus" => {
            material(|timber, tree| mean_where(&timber.youngs_modulus, tree, |d| d <= diameters(wood).0))
        }
        "rupture_stress" => {
            material(|timber, tree| mean_where(&timber.rupture_stress, tree, |d| d >= diameters(wood).1))
        }
        "young_rupture_stress" => {
            material(|timber, tree| mean_where(&timber.rupture_stress, tree, |d| d <= diameters(wood).0))
        }
        "rupture_moment" => breaking(&spec, 0.04, 0.012),
        "union_equal_stems" => breaking(&spec, 0.02, 0.02),
        "cantilever_4_links" => cantilever(&spec, JointLaw::Corrected),
        "cantilever_4_links_paper" => cantilever(&spec, JointLaw::Paper),
        "first_frequency_4_links" => {
            let (wood, frequency) = (uniform(wood), 0.2);
            let limb = straight_limb(4, LENGTH, radius_of_frequency(&wood, LENGTH, frequency));
            Ok(sway_frequency(&limb, &wood, 0, &[]) / frequency)
        }
        "elastica_p1" => elastica(&spec, 1.0),
        "elastica_p5" => elastica(&spec, 5.0),
        "ratio_1_hz" => ratio(&spec, 1.0),
        "ratio_3_hz" => ratio(&spec, 3.0),
        "ratio_10_hz" => ratio(&spec, 10.0),
        "ratio_bare" => Ok(wood.modal_damping.as_ref().map_or(f64::NAN, |law| law.ratio.si())),
        "ratio_in_leaf" => Ok(wood.modal_damping.as_ref().map_or(f64::NAN, |law| law.ratio_in_leaf.si())),
        "sway_by_size" => sway_by_size(),
        "upright" => upright(),
        _ => anyhow::bail!("measured/wood.toml: no figure has the name '{name}'"),
    }
}

/// The wood with one modulus.
fn uniform(wood: &WoodSpec) -> WoodSpec {
    WoodSpec { young: None, ..wood.clone() }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    sum / n
}

fn diameters(wood: &WoodSpec) -> (f64, f64) {
    wood.young.as_ref().map_or((0.0, 0.0), |young| young.diameter.si())
}

/// Mean property of the segments of some diameters; `None` if there are none.
fn mean_where(property: &[f64], tree: &Skeleton, takes: impl Fn(f64) -> bool) -> Option<f64> {
    let pairs = tree.segments.iter().zip(property);
    let found: Vec<f64> = pairs.filter(|(s, _)| takes(2.0 * s.radius)).map(|(_, value)| *value).collect();
    (!found.is_empty()).then(|| mean(found.into_iter()))
}

/// Mean over trees of a figure of their wood.
fn material(figure: impl Fn(&Timber, &Skeleton) -> Option<f64>) -> anyhow::Result<f64> {
    let spec = Spec::preset(Preset::CalibratedMature);
    let mut found = Vec::new();
    for world in 0..TREES {
        let tree = grow(&spec, SEED, world).with_context(|| format!("tree {world}"))?;
        found.extend(figure(&Timber::draw(&tree, &spec.wood, SEED, world), &tree));
    }
    Ok(mean(found.into_iter()))
}

/// Moment that breaks a limb of a radius off a trunk over that of its section.
fn breaking(spec: &Spec, trunk: f64, limb: f64) -> anyhow::Result<f64> {
    let section = section::rupture_moment(spec.wood.rupture_stress.si(), limb);
    let mut trial = Trial::new(trunk_and_limb(trunk, limb), &uniform(&spec.wood), &spec.sim)?;
    let moment = trial.breaking_moment(1, Vec3::y(), section)?;
    Ok(moment.map_or(f64::NAN, |moment| moment / section))
}

/// Deflection of a limb of so many links under a load across its tip, `p = P L^2 / (E I)`, in units of its length.
fn deflection(spec: &Spec, wood: &WoodSpec, links: usize, p: f64) -> anyhow::Result<f64> {
    const RADIUS: f64 = 0.003;
    let stiffness = wood.youngs_modulus.si() * section::second_moment(RADIUS);
    let mut trial = Trial::new(straight_limb(links, LENGTH, RADIUS), wood, &spec.sim)?;
    trial.load_tip(links - 1, Vec3::z() * (p * stiffness / (LENGTH * LENGTH)))?;
    Ok(trial.p_tip(links - 1).z / LENGTH)
}

/// Deflection of four links over that of a beam.
fn cantilever(spec: &Spec, law: JointLaw) -> anyhow::Result<f64> {
    let wood = WoodSpec { joint_law: law, ..uniform(&spec.wood) };
    Ok(deflection(spec, &wood, 4, 3.0 * SLOPE)? / SLOPE)
}

fn elastica(spec: &Spec, p: f64) -> anyhow::Result<f64> {
    Ok(deflection(spec, &uniform(&spec.wood), 32, p)? / elastica_tip(p).1)
}

/// Damping ratio of a plucked limb of a frequency over the asked one.
fn ratio(spec: &Spec, frequency: f64) -> anyhow::Result<f64> {
    const LINKS: usize = 8;
    const SWINGS: usize = 6;
    let wood = uniform(&spec.wood);
    let asked = wood.modal_damping.as_ref().map_or(f64::NAN, |law| law.ratio.si());
    let radius = radius_of_frequency(&wood, LENGTH, frequency);
    let load = 3.0 * SLOPE * wood.youngs_modulus.si() * section::second_moment(radius) / (LENGTH * LENGTH);
    let mut trial = Trial::new(straight_limb(LINKS, LENGTH, radius), &wood, &spec.sim)?;
    let sway = trial.pluck(LINKS - 1, Vec3::z() * load, SWINGS)?;
    Ok(sway.map_or(f64::NAN, |sway| sway.ratio / asked))
}

/// Ratio furthest from 1 of `f H^2 / D` of a tree with scaled lengths and thicknesses to that of the tree as it grew.
fn sway_by_size() -> anyhow::Result<f64> {
    const SCALES: [(f64, f64); 4] = [(0.6, 1.0), (1.5, 1.0), (1.0, 0.6), (1.0, 1.6)];
    let spec = Spec::preset(Preset::CalibratedYoung);
    let wood = uniform(&spec.wood);
    let mut furthest = 1.0_f64;
    for world in 0..5 {
        let tree = grow(&spec, SEED, world).with_context(|| format!("tree {world}"))?;
        let base = sway_frequency(&tree, &wood, 0, &[]);
        for (length, radius) in SCALES {
            let found = sway_frequency(&scaled(&tree, length, radius), &wood, 0, &[]);
            let ratio = found / base * (length * length / radius);
            if (ratio - 1.0).abs() > (furthest - 1.0).abs() {
                furthest = ratio;
            }
        }
    }
    Ok(furthest)
}

/// Median frequency of the uprights of trees with their fruit.
fn upright() -> anyhow::Result<f64> {
    let spec = Spec::preset(Preset::VerticalUfo);
    let mut found = Vec::new();
    for world in 0..10 {
        let bare = BareTree::new(&spec, SEED, world)?;
        let segments = &bare.skeleton.segments;
        let mut carried = vec![0.0; segments.len()];
        for point in bare.model.points() {
            if let Some(tether) = &point.tether {
                carried[tether.body.index()] += point.mass;
            }
        }
        for (root, segment) in segments.iter().enumerate() {
            if segment.order == 1 && segment.parent.is_some_and(|p| segments[p].order == 0) {
                found.push(sway_frequency(&bare.skeleton, &bare.spec.wood, root, &carried));
            }
        }
    }
    found.sort_by(f64::total_cmp);
    Ok(found.get(found.len() / 2).copied().unwrap_or(f64::NAN))
}
