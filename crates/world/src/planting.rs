//! A planting: the constants, tree, fruit and colours of one world, drawn before anything moves.

mod appearance;
mod variation;

pub use appearance::Appearance;

use crate::{scene, scenery};
use orchard_camera::{Scene, blade::BladeMesh};
use orchard_fruit::{Fruit, place, rehang};
use orchard_geometry::{Shape, transform};
use orchard_spec::{Spec, randomisation::Mode};
use orchard_treegen::{Skeleton, TreegenError, grow, reshape};
use std::sync::Arc;
use variation::{Crop, Variation, draw_habit};

/// A tree with its fruit, the constants that hold for it, and its colours: a function of (spec, seed, world, episode) alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Planting {
    /// The spec with this world's own wood and foliage. Fields that no dial acts on are the spec's.
    pub spec: Arc<Spec>,
    /// The tree.
    pub skeleton: Skeleton,
    /// Fruit.
    pub fruit: Vec<Fruit>,
    /// Colours.
    pub appearance: Appearance,
}

impl Planting {
    /// Draws the planting of a world's index and seed, by `spec.randomisation`. The episode matters in modes that
    /// draw again at a reset.
    ///
    /// # Errors
    /// The tree does not grow, or does not clear the ground in its drawn form.
    pub fn draw(spec: &Arc<Spec>, seed: u64, world: u32, episode: u32) -> Result<Self, TreegenError> {
        let mode = spec.randomisation.mode;
        // The world whose tree is the base of this one's.
        let source = mode.base_world(world);
        if mode == Mode::Homogeneous {
            return Ok(Self::of_tree(spec.clone(), grow(spec, seed, source)?, seed, source));
        }
        let axes = &spec.randomisation;
        let stream = |axis| mode.stream(axis, seed, world, episode);
        let variation = Variation::draw(axes, stream);
        let spec = variation.constants(spec);
        let mut base = grow(&spec, seed, source)?;
        variation.size_leaves(&mut base.leaves);
        let struts = scenery::struts(spec.scenery.as_ref());
        scenery::clear_fruit_sites(&mut base, &struts, &spec);
        let fruit = place(&spec.fruit, &base, seed, source);
        let crop = Crop::draw(axes, fruit.len(), stream);
        let fruit = crop.resized(axes, fruit);
        let habit = draw_habit(axes, base.segments.len(), stream);
        let reshaped =
            if habit.is_neutral() { None } else { Some(reshape(&base, &habit, spec.tree.clearance.si())?) };
        let now = reshaped.as_ref().unwrap_or(&base);
        let mut fruit = rehang(&spec.fruit, &fruit, &crop.order, crop.count, &base, now);
        let margin = spec.sim.contact_margin.si();
        fruit.retain(|fruit| scenery::is_clear(&struts, &fruit.p_hang_world, fruit.radius, margin));
        Ok(Self { spec, skeleton: reshaped.unwrap_or(base), fruit, appearance: variation.appearance })
    }

    /// Builds the planting of a given tree, with fruit placed for a world's index and seed.
    pub fn of_tree(spec: Arc<Spec>, mut skeleton: Skeleton, seed: u64, world: u32) -> Self {
        let struts = scenery::struts(spec.scenery.as_ref());
        scenery::clear_fruit_sites(&mut skeleton, &struts, &spec);
        let fruit = place(&spec.fruit, &skeleton, seed, world);
        Self { spec, skeleton, fruit, appearance: Appearance::default() }
    }
}

/// Picture scene of a planting as it grew, unloaded: wood, leaves, fruit and stems in their colours, posts and wires; no ground.
pub fn tree_scene(planting: &Planting) -> Scene {
    let Planting { skeleton, fruit, appearance, .. } = planting;
    let mut scene = Scene::default();
    let shapes: Vec<Shape> = scene::wood_shapes(skeleton);
    let blade = Arc::new(BladeMesh::from_spec(&planting.spec.foliage));
    scene::push_tree(&mut scene, &shapes, &skeleton.leaves, &blade, |i| {
        skeleton.segments[i].x_world_segment()
    });
    let anchors = fruit.iter().map(|fruit| (fruit.segment, &fruit.p_segment));
    scene::push_fine_wood(&mut scene, planting.spec.tree.spur_radius.si(), skeleton, anchors, |i| {
        skeleton.segments[i].x_world_segment()
    });
    for (i, fruit) in fruit.iter().enumerate() {
        scene::push_fruit(&mut scene, i, &fruit.p_hang_world, fruit.radius);
        let x_world_segment = skeleton.segments[fruit.segment].x_world_segment();
        let p_anchor_world = transform(&x_world_segment, &fruit.p_segment);
        scene::push_stem(
            &mut scene,
            planting.spec.fruit.stem_radius.si(),
            &p_anchor_world,
            &fruit.p_hang_world,
            fruit.radius,
        );
    }
    scene.items.extend(scenery::items(&scenery::struts(planting.spec.scenery.as_ref())));
    appearance.paint(&mut scene.items);
    scene
}

#[cfg(test)]
#[path = "planting_tests.rs"]
mod tests;
