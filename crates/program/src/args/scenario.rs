//! The options of a scenario, the same for every command.

use std::path::PathBuf;
use std::sync::Once;

use orchard_picker::Controller;
use orchard_scenario::{OptionValue, Options, Scenario, ScenarioError, StoredScenario};

use crate::failure::Failure;
use crate::program::Program;

/// Options that select the scenario.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "Scenario")]
pub struct ScenarioArgs {
    /// Scenario file (TOML) with any of the options below; options on the command line override it
    #[arg(long, value_name = "FILE.toml")]
    scenario: Option<PathBuf>,
    /// Built-in world config; `orchard presets` lists them [default: paper]
    #[arg(long, value_name = "NAME", conflicts_with = "config")]
    preset: Option<String>,
    /// World config from a file (TOML); with `base = "NAME"` it holds only the fields that differ from that preset
    #[arg(long, value_name = "FILE.toml")]
    config: Option<String>,
    /// Digitised tree, used in every world instead of grown trees: a skeleton (.json) or a multiscale tree graph (.mtg)
    #[arg(long, alias = "from", value_name = "FILE")]
    tree: Option<String>,
    /// Units of the lengths and of the diameters in a tree's MTG file: m, cm, mm or a multiple, as in mm,0.1mm [default: the file's, else metres]
    #[arg(long, value_name = "LENGTH[,DIAMETER]")]
    tree_unit: Option<String>,
    /// Plant of a tree's MTG file that has several [default: the first]
    #[arg(long, value_name = "NAME")]
    tree_plant: Option<String>,
    /// Strength of the randomisation on all axes, 0 to 1, or a file of changed figures [default: the config's]
    #[arg(long, value_name = "STRENGTH|FILE.toml", allow_negative_numbers = true)]
    randomisation: Option<String>,
    /// Robot; `orchard robots` lists them; or a folder with robot.urdf and robot.toml, a URDF file with its mapping beside it, or a file of
    /// changed figures of a robot [default: ridgeback-fr3]
    #[arg(long, value_name = "NAME|DIR|FILE.urdf|FILE.toml")]
    robot: Option<String>,
    /// Depth camera, or a file of changed figures; `orchard cameras` lists the cameras [default: the config's]
    #[arg(long, value_name = "NAME|FILE.toml")]
    camera: Option<String>,
    /// Fruit detector, or a file of changed figures; `orchard detectors` lists the detectors [default: `learned` for a camera with errors, in the task `detect` `learned-colour`; `paper` for the others]
    #[arg(long, value_name = "NAME|FILE.toml")]
    detector: Option<String>,
    /// Controller of the robot; `orchard controllers` lists them; or a learned policy, as a network in ONNX format with its spec FILE.json
    /// beside it [default: baseline]
    #[arg(long, value_name = "NAME|onnx:FILE.onnx")]
    controller: Option<String>,
}

/// A part of a scenario that some commands do not use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// `--robot`.
    Robot,
    /// `--camera`.
    Camera,
    /// `--detector`.
    Detector,
    /// `--controller`.
    Controller,
}

/// Index of the tree that a command shows.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct IndexArgs {
    /// Index of the tree within the seed, from 0; `--tree N` with a number means the same
    #[arg(long, value_name = "N")]
    index: Option<u32>,
}

impl IndexArgs {
    /// The index, and the options without the `--tree N` that may have given it.
    pub fn of(self, scenario: &ScenarioArgs) -> (u32, ScenarioArgs) {
        let number = scenario.tree.as_ref().and_then(|tree| tree.parse().ok());
        let tree = scenario.tree.clone().filter(|_| number.is_none());
        (self.index.or(number).unwrap_or(0), ScenarioArgs { tree, ..scenario.clone() })
    }
}

impl ScenarioArgs {
    /// The given options, including those of the scenario file.
    ///
    /// # Errors
    /// The scenario file cannot be used.
    pub fn options(&self) -> Result<Options, Failure> {
        let given = |option: &str, value: &Option<String>| {
            value.as_ref().map(|value| OptionValue::new(value, format!("--{option}")))
        };
        let here = Options {
            preset: given("preset", &self.preset),
            config: given("config", &self.config),
            tree: given("tree", &self.tree),
            tree_unit: given("tree-unit", &self.tree_unit),
            tree_plant: given("tree-plant", &self.tree_plant),
            randomisation: given("randomisation", &self.randomisation),
            robot: given("robot", &self.robot),
            camera: given("camera", &self.camera),
            detector: given("detector", &self.detector),
            controller: given("controller", &self.controller),
            rules: None,
        };
        match &self.scenario {
            None => Ok(here),
            Some(file) => {
                let below =
                    Options::from_file(file).map_err(|e| Failure::BadInput(format!("--scenario {e}")))?;
                Ok(here.over(below))
            }
        }
    }

    /// Resolves the scenario.
    ///
    /// # Errors
    /// An option that cannot be used.
    pub fn resolve(&self, program: &Program) -> Result<Scenario, Failure> {
        resolve(&self.options()?, program)
    }

    /// Resolves the scenario, with `preset` as the command's default world.
    ///
    /// # Errors
    /// An option that cannot be used.
    pub fn resolve_or(&self, program: &Program, preset: &str) -> Result<Scenario, Failure> {
        let below = Options { preset: Some(OptionValue::new(preset, "default")), ..Options::default() };
        resolve(&self.options()?.over(below), program)
    }

    /// Resolves the scenario, with `controller` as the command's default one.
    ///
    /// # Errors
    /// An option that cannot be used.
    pub fn resolve_under(&self, program: &Program, controller: &str) -> Result<Scenario, Failure> {
        let below =
            Options { controller: Some(OptionValue::new(controller, "default")), ..Options::default() };
        resolve(&self.options()?.over(below), program)
    }

    /// Resolves the scenario of a result: the stored one, unless options are given.
    ///
    /// # Errors
    /// An option or a stored scenario that cannot be used.
    pub fn resolve_stored(
        &self,
        program: &Program,
        stored: impl FnOnce() -> Result<StoredScenario, Failure>,
        by: &str,
    ) -> Result<Scenario, Failure> {
        let options = self.options()?;
        if !options.is_empty() {
            return resolve(&options, program);
        }
        Scenario::from_stored(&stored()?, program.controllers(), by).map_err(refused)
    }

    /// The options that are given, as words of a command line.
    pub fn words(&self) -> Vec<String> {
        let scenario = self.scenario.as_ref().map(|file| file.display().to_string());
        let options = [
            ("--scenario", &scenario),
            ("--preset", &self.preset),
            ("--config", &self.config),
            ("--tree", &self.tree),
            ("--tree-unit", &self.tree_unit),
            ("--tree-plant", &self.tree_plant),
            ("--randomisation", &self.randomisation),
            ("--robot", &self.robot),
            ("--camera", &self.camera),
            ("--detector", &self.detector),
            ("--controller", &self.controller),
        ];
        let given = options.into_iter().filter_map(|(name, value)| Some([name.to_owned(), value.clone()?]));
        given.flatten().collect()
    }

    /// Refuses options that a command has no use for, with the reason.
    ///
    /// # Errors
    /// One of them is given.
    pub fn refuse(&self, options: &[Part], why: &str) -> Result<(), Failure> {
        for option in options {
            let (name, given) = match option {
                Part::Robot => ("--robot", &self.robot),
                Part::Camera => ("--camera", &self.camera),
                Part::Detector => ("--detector", &self.detector),
                Part::Controller => ("--controller", &self.controller),
            };
            if given.is_some() {
                return Err(Failure::BadInput(format!("{name}: {why}")));
            }
        }
        Ok(())
    }

    /// The given options except scenario file and controller, in the order of the command line, for the names of result folders.
    pub fn given(&self) -> Vec<&str> {
        let all = [
            &self.preset,
            &self.config,
            &self.tree,
            &self.tree_unit,
            &self.tree_plant,
            &self.randomisation,
            &self.robot,
            &self.camera,
            &self.detector,
        ];
        all.into_iter().flatten().map(String::as_str).collect()
    }

    /// The scenario file, if one is given.
    pub fn file(&self) -> Option<&PathBuf> {
        self.scenario.as_ref()
    }

    /// The controller, if one is given on the command line.
    pub fn controller(&self) -> Option<&str> {
        self.controller.as_deref()
    }
}

fn resolve(options: &Options, program: &Program) -> Result<Scenario, Failure> {
    let scenario = Scenario::resolve(options, program.controllers()).map_err(refused)?;
    TOLD.call_once(|| tell_warnings(&scenario));
    Ok(scenario)
}

/// Called once a process: a command may resolve its scenario several times.
static TOLD: Once = Once::new();

/// Tells what the robot's description leaves open or gets wrong, what was assumed of a digitised tree, and what is to be known of the controller.
fn tell_warnings(scenario: &Scenario) {
    if let Some(tree) = scenario.digitised_tree() {
        for text in tree.notes() {
            note!("note: tree {}: {text}", tree.name());
        }
    }
    let name = &scenario.names().scene.robot;
    for warning in scenario.robot().warnings() {
        note!("note: robot {name}: {warning}");
    }
    for text in scenario.controller_kind().notes() {
        note!("note: controller {}: {text}", scenario.names().controller);
    }
}

/// The controller of an episode without a goal.
///
/// # Errors
/// The scenario's controller needs a goal.
pub fn controller(scenario: &Scenario) -> Result<Box<dyn Controller>, Failure> {
    if scenario.controller_kind().needs_goal() {
        let name = &scenario.names().controller;
        let problem = "it needs a goal, which only the tasks reach-and-grasp and gentle give";
        return Err(Failure::BadInput(format!("controller {name}: {problem}")));
    }
    Ok(scenario.controller())
}

fn refused(e: ScenarioError) -> Failure {
    Failure::BadInput(e.to_string())
}
