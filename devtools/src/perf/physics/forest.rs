//! The trees that are timed.

use std::sync::Arc;

use anyhow::{Context, bail};
use orchard_batch::TreeWorld;
use orchard_exchange::mjcf;
use orchard_fruit::{Fruit, place};
use orchard_spec::tree::Grammar;
use orchard_spec::{Preset, Purpose, Spec, Stream};
use orchard_treegen::{Segment, Skeleton, grow};
use rayon::prelude::*;

/// Seed of all trees and kicks.
const SEED: u64 = 1;
/// Largest rate that a kick gives a joint \[rad/s\].
const KICK: f64 = 1.0;
/// Largest relative difference between lengths and radii of siblings; their wood is the same.
const SIBLING_LENGTH: f64 = 0.1;
const SIBLING_RADIUS: f64 = 0.05;

/// Strengths of stems that bend, beside the pull that a tether bears: medians of the preset `calibrated` [N m, N].
const TWIST: f64 = 0.0961;
const SPUR: f64 = 113.0;

/// A tree with its fruit, not yet in a model.
#[derive(Debug, Clone)]
pub struct Planting {
    pub spec: Arc<Spec>,
    pub skeleton: Skeleton,
    pub fruit: Vec<Fruit>,
}

impl Planting {
    fn grow(spec: &Arc<Spec>, world: u32) -> anyhow::Result<Self> {
        let skeleton = grow(spec, SEED, world)?;
        let fruit = place(&spec.fruit, &skeleton, SEED, world);
        Ok(Self { spec: spec.clone(), skeleton, fruit })
    }

    /// The tree in a world, every joint kicked at a rate of its own.
    pub fn kicked(&self, index: u32) -> anyhow::Result<TreeWorld> {
        let mut world = TreeWorld::new(self.spec.clone(), &self.skeleton, self.fruit.clone())?;
        kick(&mut world.data_mut().v, index);
        Ok(world)
    }

    /// Returns the tree without fruit, with its segments split so that there are `count` pieces.
    pub fn refined(&self, segments: usize) -> Self {
        let coarse = &self.skeleton.segments;
        let mut fine: Vec<Segment> = Vec::with_capacity(segments);
        let mut last_piece = Vec::with_capacity(coarse.len());
        for (index, segment) in coarse.iter().enumerate() {
            let pieces = segments * (index + 1) / coarse.len() - segments * index / coarse.len();
            let mut parent = segment.parent.map(|parent: usize| last_piece[parent]);
            let length = segment.length / pieces as f64;
            for piece in 0..pieces {
                let p_base_world = segment.p_base_world + segment.heading() * (length * piece as f64);
                fine.push(Segment { parent, p_base_world, length, ..segment.clone() });
                parent = Some(fine.len() - 1);
            }
            last_piece.push(fine.len() - 1);
        }
        let skeleton =
            Skeleton { segments: fine, fruit_sites: Vec::new(), leaves: Vec::new(), spurs: Vec::new() };
        Self { spec: self.spec.clone(), skeleton, fruit: Vec::new() }
    }

    /// Sum over the links of their squared depth (the root has depth 1): proportional to the cost of a sparse factorisation of the
    /// joint-space inertia.
    pub fn depth_squares(&self) -> usize {
        self.depths().iter().map(|depth| depth * depth).sum()
    }

    /// Mean depth of the links.
    pub fn mean_depth(&self) -> f64 {
        let depths = self.depths();
        depths.iter().sum::<usize>() as f64 / depths.len() as f64
    }

    fn depths(&self) -> Vec<usize> {
        let mut depths = Vec::with_capacity(self.skeleton.segments.len());
        for segment in &self.skeleton.segments {
            depths.push(segment.parent.map_or(1, |parent: usize| 1 + depths[parent]));
        }
        depths
    }

    /// A tree of the same topology with dimensions of its own.
    pub fn sibling(&self, index: u32) -> Self {
        let mut sibling = self.clone();
        let mut stream = Stream::new(SEED, index, Purpose::Test);
        for segment in &mut sibling.skeleton.segments {
            segment.length *= stream.uniform(1.0 - SIBLING_LENGTH, 1.0 + SIBLING_LENGTH);
            segment.radius *= stream.uniform(1.0 - SIBLING_RADIUS, 1.0 + SIBLING_RADIUS);
        }
        sibling
    }
}

/// Mean wind in the rows about wind, at the height of the canopy [m/s].
const WIND: f64 = 5.0;

/// Air and hold of the fruit of timed trees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// On tethers in still air, as in `paper`.
    Tethers,
    /// On stems that bend, in still air.
    Stems,
    /// On such stems in wind.
    StemsInWind,
}

impl Hold {
    /// All, those without the others' cost first.
    pub const ALL: [Self; 3] = [Self::Tethers, Self::Stems, Self::StemsInWind];

    /// Name in a row.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tethers => "tethers",
            Self::Stems => "stems",
            Self::StemsInWind => "stems_in_wind",
        }
    }

    /// Worlds of one tree whose fruit are held so, with dimensions of their own and kicked: the same wood, fruit and kicks in each kind.
    pub fn worlds(self, tree: &Planting, count: usize) -> anyhow::Result<Vec<TreeWorld>> {
        let mut spec = Spec::clone(&tree.spec);
        let measured = Spec::preset(Preset::Calibrated);
        if self != Self::Tethers {
            spec.fruit.stem = measured.fruit.stem;
        }
        if self == Self::StemsInWind {
            let mut wind = measured.wind.context("the preset calibrated has no table [wind]")?;
            wind.speed = wind.speed.with_value(WIND).map_err(anyhow::Error::msg)?;
            spec.wind = Some(wind);
        }
        let spec = Arc::new(spec);
        (0..count as u32)
            .into_par_iter()
            .map(|index| {
                let Planting { skeleton, mut fruit, .. } = tree.sibling(index);
                // Tethers have no other strengths.
                for fruit in &mut fruit {
                    (fruit.twist_strength, fruit.spur_strength) = (TWIST, SPUR);
                }
                let mut world = TreeWorld::drawn(spec.clone(), &skeleton, fruit, SEED, index)?;
                kick(&mut world.data_mut().v, index);
                Ok(world)
            })
            .collect()
    }
}

/// Gives every degree of freedom a random rate; `index` chooses the kick.
pub fn kick(v: &mut [f64], index: u32) {
    let mut stream = Stream::new(SEED + 1, index, Purpose::Test);
    for v in v {
        *v = stream.uniform(-KICK, KICK);
    }
}

/// A world at its present state for MuJoCo.
pub fn mjcf_of(world: &TreeWorld) -> anyhow::Result<String> {
    let plant = world.plant();
    let settings = &plant.settings;
    Ok(mjcf::write_for_timing("tree", &plant.model, world.data(), &settings.gravity, settings.h)?)
}

/// The paper's config with a number of fruit per tree.
pub fn spec_with_fruit(fruit: u32) -> anyhow::Result<Spec> {
    let mut spec = Spec::paper();
    spec.fruit.count = spec.fruit.count.with_value(fruit).map_err(anyhow::Error::msg)?;
    Ok(spec)
}

/// The `count` trees nearest to a number of links that carry all their fruit, nearest first, of the first
/// `searched` worlds.
pub fn nearest(spec: Spec, links: usize, count: usize, searched: u32) -> anyhow::Result<Vec<Planting>> {
    let spec = Arc::new(spec);
    let mut found: Vec<(usize, u32)> = (0..searched)
        .into_par_iter()
        .filter_map(|world| Some((grow(&spec, SEED, world).ok()?.segments.len().abs_diff(links), world)))
        .collect();
    found.sort_unstable();
    let fruit = spec.fruit.count.get() as usize;
    let mut plantings = Vec::with_capacity(count);
    for (_, world) in found {
        if plantings.len() == count {
            break;
        }
        let planting = Planting::grow(&spec, world)?;
        if planting.fruit.len() == fruit {
            plantings.push(planting);
        }
    }
    let complete = plantings.len() == count;
    complete.then_some(plantings).with_context(|| format!("too few trees with {fruit} fruit"))
}

/// The paper's grammar with a bound on a tree's segments, without fruit.
pub fn spec_with_segments(most: u32) -> anyhow::Result<Spec> {
    let mut spec = spec_with_fruit(0)?;
    let Grammar::CentralLeader(grammar) = &mut spec.tree.grammar else {
        bail!("the preset `paper` does not use the expected grammar")
    };
    grammar.segments_max = grammar.segments_max.with_value(most).map_err(anyhow::Error::msg)?;
    Ok(spec)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refined_tree_is_the_same_wood() {
        let tree = nearest(spec_with_segments(50).unwrap(), 50, 1, 8).unwrap().remove(0);
        let fine = tree.refined(333);
        assert_eq!(fine.skeleton.segments.len(), 333);
        let length = |tree: &Planting| tree.skeleton.segments.iter().map(|s| s.length).sum::<f64>();
        assert!((length(&fine) - length(&tree)).abs() < 1e-12);
        for segment in &fine.skeleton.segments {
            let Some(parent) = segment.parent else { continue };
            let gap = (fine.skeleton.segments[parent].p_tip_world() - segment.p_base_world).norm();
            assert!(gap < 1e-12, "{gap}");
        }
    }
}
