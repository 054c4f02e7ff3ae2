//! Resolved scenarios of runs: world, tree, robot, camera, detector, controller and task rules.
//!
//! [`Options`] hold a user's settings, from a file or a command line. [`Scenario::resolve`] resolves them once, at the start of a program,
//! into a [`Scenario`]; later code uses no preset names. [`Scenario::world`] builds worlds and [`Scenario::controller`] makes their
//! controllers. Every result contains the scenario's hash ([`Scenario::hash`]) and the scenario itself ([`StoredScenario`]).
//! [`Scenario::figures`] lists every figure with its origin.

mod changes;
mod controller;
mod digest;
mod error;
mod faults;
mod figures;
mod limits;
mod mesh_files;
mod names;
mod options;
mod resolve;
mod robot;
mod stored;
mod tree;

pub use changes::Changes;
pub use error::ScenarioError;
pub use figures::Figure;
pub use mesh_files::MeshFiles;
pub use names::{Names, SceneNames, controller_name};
pub use options::{OptionValue, Options};
pub use orchard_digitised::{TreeFile, TreeFormat};
pub use orchard_perception::{detector_for, detectors, geometric_detector_for};
pub use resolve::{cameras, controllers, detector, presets, robots};
pub use robot::RobotFiles;
pub use stored::StoredScenario;

use std::sync::Arc;

use orchard_perception::DetectorConfig;
use orchard_picker::{Controller, ControllerKind, Goal};
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_treegen::TreegenError;
use orchard_world::{Planting, World, WorldError};

/// A resolved scenario: config, tree, robot, detector and controller of a run.
#[derive(Clone)]
pub struct Scenario {
    names: Names,
    spec: Arc<Spec>,
    tree: Option<Arc<TreeFile>>,
    robot: Arc<RobotModel>,
    /// The robot's files, if it does not come with the program.
    robot_files: Option<Arc<RobotFiles>>,
    detector: DetectorConfig,
    /// True if nobody named the detector.
    detector_by_default: bool,
    controller: Arc<dyn ControllerKind>,
    /// Changed figures of the protocol, as TOML tables.
    rules: toml::Table,
    layers: figures::Layers,
}

impl Scenario {
    /// Resolves options, given by their names on command lines, with the controllers of this project:
    /// `Scenario::of(&[("preset", "tall-spindle"), ("camera", "d435i")])`. Without options it is the benchmark's own scenario.
    ///
    /// # Errors
    /// As [`Scenario::resolve`].
    pub fn of(options: &[(&str, &str)]) -> Result<Self, ScenarioError> {
        Self::resolve(&Options::of(options)?, &controllers())
    }

    /// Returns the scenario under another controller.
    #[must_use]
    pub fn with_controller(&self, controller: impl ControllerKind + 'static) -> Self {
        self.under_kind(Arc::new(controller))
    }

    fn under_kind(&self, controller: Arc<dyn ControllerKind>) -> Self {
        let names = Names { controller: controller.name().to_owned(), ..self.names.clone() };
        Self { names, controller, ..self.clone() }
    }

    /// Names of all parts.
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// The parts except the controller in which the scenario differs from the benchmark's own; `None` if there are none.
    pub fn differences(&self) -> Option<String> {
        let own = SceneNames::paper();
        let named = self.names.scene.list().into_iter().zip(own.list());
        let parts: Vec<String> =
            named.filter(|(a, b)| a != b).map(|((part, name), _)| format!("{part} {name}")).collect();
        if !parts.is_empty() {
            return Some(parts.join(", "));
        }
        self.changes_rules().then(|| "changed rules".to_owned())
    }

    /// The world's config, with its camera and randomisation.
    pub fn spec(&self) -> &Arc<Spec> {
        &self.spec
    }

    /// The digitised tree of every world; none if each world grows its own tree.
    pub fn digitised_tree(&self) -> Option<&TreeFile> {
        self.tree.as_deref()
    }

    /// The robot.
    pub fn robot(&self) -> &Arc<RobotModel> {
        &self.robot
    }

    /// The detector's config.
    pub fn detector(&self) -> &DetectorConfig {
        &self.detector
    }

    /// The kind of controller.
    pub fn controller_kind(&self) -> &dyn ControllerKind {
        &*self.controller
    }

    /// Changed figures of the protocol. Each task reads its own.
    pub fn rules(&self) -> &toml::Table {
        &self.rules
    }

    /// Returns the scenario with another world config and the same names, for example for a condition of a benchmark.
    #[must_use]
    pub fn with_spec(&self, spec: Spec) -> Self {
        Self { spec: Arc::new(spec), ..self.clone() }
    }

    /// Builds the world with an index of a seed, at rest, with the robot at the start pose of a repeat. With a digitised tree every world
    /// has that tree; seed and index determine its fruit and, if the file has none, its leaves. Its observations have the colour pictures that
    /// the controllers ask for.
    ///
    /// # Errors
    /// The world cannot be built.
    pub fn world(&self, seed: u64, world: u32, repeat: u32) -> Result<World, WorldError> {
        let (spec, robot) = (self.spec.clone(), self.robot.clone());
        let mut built = match &self.tree {
            None => World::of_repeat(spec, robot, seed, world, repeat)?,
            Some(tree) => {
                let skeleton = tree.skeleton(&spec, seed, world);
                World::with_tree(spec, robot, skeleton, seed, world, repeat)?
            }
        };
        built.deliver_pictures(self.controller.pictures());
        built.deliver_colour(self.detector.sees_colour());
        Ok(built)
    }

    /// Tree, fruit, colours and constants of the world with an index of a seed, without a model.
    ///
    /// # Errors
    /// The tree does not grow.
    pub fn planting(&self, seed: u64, world: u32) -> Result<Planting, TreegenError> {
        match &self.tree {
            None => Planting::draw(&self.spec, seed, world, 0),
            Some(tree) => {
                let skeleton = tree.skeleton(&self.spec, seed, world);
                Ok(Planting::of_tree(self.spec.clone(), skeleton, seed, world))
            }
        }
    }

    /// Makes a controller at the start of an episode, behind the fault of the world's config, if it has one.
    pub fn controller(&self) -> Box<dyn Controller> {
        self.behind_fault(self.controller.controller(&self.robot, &self.detector))
    }

    /// Makes a controller at the start of a trial with a goal, behind the fault of the world's config, if it has one; `None` if this kind of controller
    /// cannot be given a goal.
    pub fn controller_with_goal(&self, goal: &Goal) -> Option<Box<dyn Controller>> {
        let controller = self.controller.with_goal(goal, &self.robot, &self.detector)?;
        Some(self.behind_fault(controller))
    }

    fn behind_fault(&self, controller: Box<dyn Controller>) -> Box<dyn Controller> {
        faults::Faulty::wrap(controller, self.spec.fault.as_ref(), &self.robot)
    }
}

impl std::fmt::Debug for Scenario {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scenario")
            .field("names", &self.names)
            .field("hash", &self.hash())
            .finish_non_exhaustive()
    }
}

impl PartialEq for Scenario {
    fn eq(&self, other: &Self) -> bool {
        self.stored() == other.stored()
    }
}
