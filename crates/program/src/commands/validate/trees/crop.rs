//! The crop of dwarf trees: its mass, and the strength of the wood under it.

use anyhow::Context;
use indicatif::ProgressBar;
use orchard_multibody::statics::equilibrium;
use orchard_treegen::calibration::{Check, Measured, Population, dwarf::mean_of};
use orchard_treegen::morphometry::distribution::quantile;
use rayon::prelude::*;

use crate::bare_tree::BareTree;

/// Largest move of a coordinate in the last iteration at which the tree counts as at rest \[rad or m\].
const TOLERANCE: f64 = 1e-9;

/// Fruit load of one tree.
struct Load {
    fruit: f64,
    /// Mass of the fruit \[kg\].
    crop: f64,
    /// Largest bending moment of any joint over its rupture moment, at rest; infinite if the tree does not come to rest.
    worst: f64,
    /// The tree and its segment at that joint.
    at: String,
}

/// Loads every tree with its fruit, computes the static equilibrium, and compares.
pub fn checks(
    measured: &Measured,
    trees: &Population,
    seed: u64,
    bar: &ProgressBar,
) -> anyhow::Result<[Check; 3]> {
    let loads: Vec<Load> = (0..trees.trees.len())
        .into_par_iter()
        .map(|world| {
            let load = load(trees, seed, world);
            bar.inc(1);
            load.with_context(|| format!("tree {world}"))
        })
        .collect::<anyhow::Result<_>>()?;
    let each = |figure: fn(&Load) -> f64| loads.iter().map(figure).collect::<Vec<f64>>();
    let t = &measured.dwarf.targets;
    let worst = each(|load| load.worst);
    let broken = worst.iter().filter(|ratio| **ratio > 1.0).count();
    let heaviest = loads.iter().max_by(|a, b| a.worst.total_cmp(&b.worst));
    let at = heaviest.map_or("", |load| load.at.as_str());
    let note = format!(
        "largest of all joints of all trees at rest ({at}); median tree {:.2}; trees with a joint over its rupture moment: {broken}",
        quantile(&worst, 0.5)
    );
    let largest = worst.iter().copied().fold(0.0, f64::max);
    Ok([
        mean_of(&t.fruit, "dwarf.fruit", &each(|load| load.fruit)),
        mean_of(&t.crop, "dwarf.crop", &each(|load| load.crop)),
        t.load.check("dwarf.load", largest).noted(note),
    ])
}

fn load(trees: &Population, seed: u64, world: usize) -> anyhow::Result<Load> {
    let skeleton = trees.trees[world].skeleton.clone();
    let number = u32::try_from(world)?;
    let mut bare = BareTree::of_skeleton(&trees.spec, skeleton, String::new(), seed, number)?;
    let at_rest = equilibrium(&bare.model, &mut bare.data, &bare.gravity, TOLERANCE);
    let ratio = |i: usize| {
        let angle = bare.tree.bending_angle(&bare.model, &bare.data, i);
        bare.tree.stiffness[i] * angle / bare.tree.rupture_moment[i]
    };
    // The trunk's base is fixed by the soil and does not break.
    let worst = (1..bare.tree.len()).map(|i| (ratio(i), i)).max_by(|a, b| a.0.total_cmp(&b.0));
    let (worst, segment) = worst.unwrap_or((0.0, 0));
    let weakest = &bare.skeleton.segments[segment];
    let at = format!(
        "tree {world}, segment {segment} of order {}, radius {:.1} mm",
        weakest.order,
        1e3 * weakest.radius
    );
    Ok(Load {
        fruit: bare.model.points().len() as f64,
        crop: bare.model.points().iter().map(|point| point.mass).sum(),
        worst: if at_rest.is_ok() { worst } else { f64::INFINITY },
        at,
    })
}
