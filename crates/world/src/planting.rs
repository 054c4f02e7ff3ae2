//! What stands in a world before anything moves: its own constants, its tree, its fruit and its colours.

mod appearance;
mod variation;

pub use appearance::Appearance;

use crate::scene;
use orchard_camera::Scene;
use orchard_fruit::{Fruit, place, rehang};
use orchard_geometry::{Shape, transform};
use orchard_spec::{Purpose, Spec, Stream, randomisation::Mode};
use orchard_treegen::{Skeleton, TreegenError, dress_with_leaves, grow, reshape};
use std::sync::Arc;
use variation::Variation;

/// A tree with its fruit, the constants that hold for it, and its colours: a function of (spec, seed, world, episode) alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Planting {
    /// The spec with this world's own wood and foliage. What no dial acts on is the spec's.
    pub spec: Arc<Spec>,
    /// The tree.
    pub skeleton: Skeleton,
    /// Its fruit.
    pub fruit: Vec<Fruit>,
    /// Its colours.
    pub appearance: Appearance,
}

impl Planting {
    /// Draws the planting of a world's index and seed, as `spec.randomisation` says. The episode counts in modes that
    /// sample anew at a reset.
    ///
    /// # Errors
    /// The tree does not grow, or does not clear the ground in its drawn form.
    pub fn draw(spec: &Arc<Spec>, seed: u64, world: u32, episode: u32) -> Result<Self, TreegenError> {
        let mode = spec.randomisation.mode;
        // The world whose tree this one's is made of.
        let source = mode.base_world(world);
        let base = Self::of_tree(spec.clone(), grow(spec, seed, source)?, seed, source);
        if mode == Mode::Homogeneous {
            return Ok(base);
        }
        let stream = |axis| mode.stream(axis, seed, world, episode);
        let variation =
            Variation::draw(&spec.randomisation, base.skeleton.segments.len(), base.fruit.len(), stream);
        let spec = variation.constants(spec);
        let skeleton = if !variation.habit.is_neutral() {
            let foliage = Stream::new(seed, source, Purpose::Foliage);
            Some(reshape(&spec, &base.skeleton, &variation.habit, foliage)?)
        } else if spec.foliage != base.spec.foliage {
            let leaves = dress_with_leaves(&spec, &base.skeleton.segments, seed, source);
            Some(Skeleton { leaves, ..base.skeleton.clone() })
        } else {
            None
        };
        let mut fruit = variation.fruit(&spec.randomisation, base.fruit);
        if variation.moves_fruit() {
            let now = skeleton.as_ref().unwrap_or(&base.skeleton);
            fruit = rehang(&spec.fruit, fruit, &base.skeleton, now);
        }
        let skeleton = skeleton.unwrap_or(base.skeleton);
        Ok(Self { spec, skeleton, fruit, appearance: variation.appearance })
    }

    /// A tree that is taken as it is, with fruit placed for a world's index and seed.
    pub fn of_tree(spec: Arc<Spec>, skeleton: Skeleton, seed: u64, world: u32) -> Self {
        let fruit = place(&spec.fruit, &skeleton, seed, world);
        Self { spec, skeleton, fruit, appearance: Appearance::default() }
    }
}

/// What people see of a planting as it grew, unloaded: wood, leaves, fruit and stems in their colours; no ground.
pub fn tree_scene(planting: &Planting) -> Scene {
    let Planting { skeleton, fruit, appearance, .. } = planting;
    let mut scene = Scene::default();
    let shapes: Vec<Shape> = scene::wood_shapes(skeleton);
    scene::push_tree(&mut scene, &shapes, &skeleton.leaves, |i| skeleton.segments[i].x_world_segment());
    for (i, fruit) in fruit.iter().enumerate() {
        scene::push_fruit(&mut scene, i, &fruit.p_hang_world, fruit.radius);
        let x_world_segment = skeleton.segments[fruit.segment].x_world_segment();
        let p_anchor_world = transform(&x_world_segment, &fruit.p_segment);
        scene::push_stem(&mut scene, &p_anchor_world, &fruit.p_hang_world, fruit.radius);
    }
    appearance.paint(&mut scene);
    scene
}

#[cfg(test)]
#[path = "planting_tests.rs"]
mod tests;
