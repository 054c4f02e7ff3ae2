//! Suite `fruit`: sizes, masses, clusters and bruises of the fruit of `calibrated` trees against measurements.

use std::collections::BTreeMap;
use std::sync::Arc;

use orchard_fruit::{Bruise, Fruit, place};
use orchard_quantity::from_toml;
use orchard_robot::RobotModel;
use orchard_spec::{Preset, Spec};
use orchard_treegen::grow;
use orchard_treegen::morphometry::distribution::mean_and_sd;
use orchard_world::World;
use serde::{Deserialize, Serialize};

use super::target::{self, Target};
use crate::rows::{Effort, Measured};

/// Trees whose fruit are measured; their seed.
const TREES: u32 = 20;
const SEED: u64 = 1;

/// Time in the wind in which hanging fruit are watched \[s\].
const WATCH: f64 = 2.0;

/// Strongest wind of the dial [m/s].
const STRONGEST: f64 = 12.0;

/// `configs/measured/fruit.toml`.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MeasuredFruit {
    clusters: Clusters,
    targets: BTreeMap<String, Target>,
}

/// Number of clusters by the number of their fruit, from one.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Clusters {
    counts: Vec<u32>,
    source: String,
}

/// Compares the figures of fruit.
pub fn measure(_: Effort) -> anyhow::Result<Measured> {
    let MeasuredFruit { clusters, targets } =
        from_toml("measured/fruit.toml", include_str!("../../../configs/measured/fruit.toml"))?;
    let spec = Spec::preset(Preset::Calibrated);
    let mut fruit: Vec<Vec<Fruit>> = Vec::new();
    for world in 0..TREES {
        fruit.push(place(&spec.fruit, &grow(&spec, SEED, world)?, SEED, world));
    }
    let density = |fruit: &Fruit| fruit.mass / (8.0 * fruit.radius * fruit.radius * fruit.radius);
    let densities: Vec<f64> = fruit.iter().flatten().map(density).collect();
    let (mean, spread) = mean_and_sd(&densities);
    let sizes: Vec<usize> =
        fruit.iter().flat_map(|tree| tree.chunk_by(|a, b| a.site == b.site).map(<[Fruit]>::len)).collect();
    let volume = |energy: f64, squeeze: f64| {
        let bruise = Bruise { peak_impact_energy: energy, peak_squeeze_force: squeeze, ..Bruise::default() };
        bruise.volume(&spec.fruit).unwrap_or(f64::NAN)
    };
    let figure = |name: &str| {
        Ok(match name {
            "mass_per_cube" => mean,
            "mass_per_cube_spread" => spread,
            "cluster_sizes" => distance(&sizes, &clusters.counts),
            "cluster_mean" => sizes.iter().sum::<usize>() as f64 / sizes.len() as f64,
            "cluster_overlap" => deepest_overlap(&spec)?,
            "bruise_energy" => largest_harmless(&spec),
            "bruise_impact" => volume(1.5, 0.0) - volume(0.5, 0.0),
            "bruise_squeeze_57" => volume(0.0, 57.0),
            "bruise_squeeze_106" => volume(0.0, 106.0),
            _ => anyhow::bail!("measured/fruit.toml: no figure has the name '{name}'"),
        })
    };
    Ok(target::compare("fruit", targets, figure)?.into())
}

/// Furthest distance between the distribution of sizes and that of counted clusters.
fn distance(sizes: &[usize], counts: &[u32]) -> f64 {
    let all = f64::from(counts.iter().sum::<u32>());
    let up_to = |size: usize| {
        let seen = sizes.iter().filter(|s| **s <= size).count() as f64 / sizes.len() as f64;
        let counted = f64::from(counts[..size].iter().sum::<u32>()) / all;
        (seen - counted).abs()
    };
    (1..=counts.len()).map(up_to).fold(0.0, f64::max)
}

/// Largest energy that does not count as a bruise \[J\], to a thousandth of a joule.
fn largest_harmless(spec: &Spec) -> f64 {
    let harmless =
        |&energy: &f64| !Bruise { peak_impact_energy: energy, ..Bruise::default() }.is_bruised(&spec.fruit);
    (0..1000).map(|k| f64::from(k) * 1e-3).take_while(harmless).last().unwrap_or(f64::NAN)
}

/// Deepest overlap of two hanging fruit in the strongest wind, over the sum of their radii, beyond that at rest.
fn deepest_overlap(spec: &Spec) -> anyhow::Result<f64> {
    let mut spec = spec.clone();
    if let Some(wind) = &mut spec.wind {
        wind.speed = wind.speed.with_value(STRONGEST).map_err(anyhow::Error::msg)?;
    }
    let frames = (WATCH * spec.sim.frame_rate.si()) as u32;
    let mut world = World::new(Arc::new(spec), Arc::new(RobotModel::paper()), SEED, 0)?;
    let hold = world.robot().start_command();
    let at_rest: BTreeMap<(usize, usize), f64> = overlaps(&world).collect();
    let mut deepest: f64 = 0.0;
    for _ in 0..frames {
        world.step(&hold);
        let grown = |pair: &(usize, usize)| at_rest.get(pair).copied().unwrap_or(0.0);
        deepest = overlaps(&world).map(|(pair, overlap)| overlap - grown(&pair)).fold(deepest, f64::max);
    }
    Ok(deepest)
}

/// Overlap of each pair of hanging fruit that overlap, over the sum of their radii.
fn overlaps(world: &World) -> impl Iterator<Item = ((usize, usize), f64)> + '_ {
    let (set, data) = (world.fruit(), world.data());
    let p_world = |i: usize| data.point_p_world[set.points[i].index()];
    let overlap = move |i: usize, j: usize| {
        1.0 - (p_world(i) - p_world(j)).norm() / (set.fruit[i].radius + set.fruit[j].radius)
    };
    let hangs = move |i: &usize| data.tethered[set.points[*i].index()];
    let pairs = (0..set.len()).filter(hangs).flat_map(move |i| (0..i).filter(hangs).map(move |j| (i, j)));
    pairs.map(move |(i, j)| ((i, j), overlap(i, j))).filter(|(_, overlap)| *overlap > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_has_a_figure_that_meets_its_target() {
        target::tests::assert_all_meet(measure(Effort::Quick).unwrap().rows);
    }

    #[test]
    fn distances_are_those_of_distribution_functions() {
        assert_eq!(distance(&[1, 1, 2, 2], &[2, 2]), 0.0);
        assert_eq!(distance(&[2, 2], &[1, 1]), 0.5);
    }
}
