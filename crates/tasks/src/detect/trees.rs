//! The trees of the task: worlds of the preset at rest, without their robot.

use orchard_camera::{Label, Scene};
use orchard_scenario::Scenario;
use orchard_world::truth::FruitTruth;

/// A tree at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct RestingTree {
    /// Scene without robot.
    pub scene: Scene,
    /// Scene with what only colour pictures show.
    pub picture: Scene,
    /// Every fruit, by its instance number in the scene.
    pub fruit: Vec<FruitTruth>,
    /// True if each fruit counts as reachable, for the zone frame.
    pub reachable: Vec<bool>,
}

/// Grows trees.
pub trait Trees: Sync {
    /// The tree of a seed and world index at a foliage density. Trees at different densities differ only in leaves.
    ///
    /// # Errors
    /// The tree cannot be built; the reason is in one line.
    fn tree(&self, seed: u64, world: u32, foliage: f64) -> Result<RestingTree, String>;
}

/// The trees of a scenario.
impl Trees for Scenario {
    fn tree(&self, seed: u64, world: u32, foliage: f64) -> Result<RestingTree, String> {
        let mut spec = (**self.spec()).clone();
        spec.foliage.density = spec.foliage.density.with_value(foliage)?;
        let world = self.with_spec(spec).world(seed, world, 0).map_err(|e| e.to_string())?;
        let (mut scene, mut picture) = (world.scene(), world.picture_scene());
        for scene in [&mut scene, &mut picture] {
            scene.items.retain(|item| item.label != Label::Robot);
        }
        Ok(RestingTree { scene, picture, fruit: world.fruit_truth(), reachable: world.reachable() })
    }
}
