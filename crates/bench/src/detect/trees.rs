//! The trees of the task: worlds of the preset at rest, without their robot.

use std::sync::Arc;

use orchard_camera::{Label, Scene};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_world::World;
use orchard_world::truth::FruitTruth;

/// A tree at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct RestingTree {
    /// What can be seen; no robot.
    pub scene: Scene,
    /// Every fruit, by the instance that the scene gives it.
    pub fruit: Vec<FruitTruth>,
    /// Whether each fruit counts as reachable, for the zone frame.
    pub reachable: Vec<bool>,
}

/// Grows trees.
pub trait Trees: Sync {
    /// The tree of a seed and a world's index at a foliage density. At other densities it differs in leaves alone.
    ///
    /// # Errors
    /// It cannot be built, with the reason in one line.
    fn tree(&self, seed: u64, world: u32, foliage: f64) -> Result<RestingTree, String>;
}

/// The benchmark's own trees: preset `paper`.
#[derive(Debug, Clone)]
pub struct PaperTrees {
    spec: Spec,
    robot: Arc<RobotModel>,
}

impl PaperTrees {
    /// The trees of preset `paper`.
    pub fn new() -> Self {
        Self { spec: Spec::paper(), robot: Arc::new(RobotModel::paper()) }
    }

    /// Name of the preset.
    pub fn preset(&self) -> &str {
        &self.spec.preset
    }

    /// The texts that they depend on, by name.
    pub fn texts() -> Vec<(&'static str, &'static str)> {
        vec![
            ("world.toml", orchard_spec::Preset::Paper.toml()),
            ("robot.toml", orchard_robot::PAPER_TOML),
            ("robot.urdf", orchard_robot::PAPER_URDF),
        ]
    }
}

impl Default for PaperTrees {
    fn default() -> Self {
        Self::new()
    }
}

impl Trees for PaperTrees {
    fn tree(&self, seed: u64, world: u32, foliage: f64) -> Result<RestingTree, String> {
        let mut spec = self.spec.clone();
        spec.foliage.density = spec.foliage.density.with_value(foliage)?;
        let world = World::new(Arc::new(spec), self.robot.clone(), seed, world).map_err(|e| e.to_string())?;
        let mut scene = world.scene();
        scene.items.retain(|item| item.label != Label::Robot);
        Ok(RestingTree { scene, fruit: world.fruit_truth(), reachable: world.reachable() })
    }
}
