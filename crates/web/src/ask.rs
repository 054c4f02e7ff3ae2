//! Options of a session as a page gives them: JSON with names and numbers.

use std::sync::Arc;

use orchard_learned::NETWORK_MAX;
use orchard_perception::{DetectorConfig, detector_for};
use orchard_picker::{ControllerKind, Kind};
use orchard_play::{Make, Overlay, Session};
use orchard_quantity::Quantity;
use orchard_robot::RobotModel;
use orchard_spec::camera::CameraSpec;
use orchard_spec::{Preset, Spec};
use orchard_world::World;
use serde::{Deserialize, Serialize};

use crate::driver::Driver;
use crate::parts::{AskError, Parts, shown};
use crate::policy::{self, POLICY, PolicyFiles};
use crate::tab::{OVERLAYS, Tab};
use crate::tree::{self, Named, TreeBytes};

/// The foliage dial in a world's config.
const FOLIAGE: &str = "foliage.density";

/// Options of a session. A field without a value keeps the default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ask {
    /// Preset of the world.
    pub preset: String,
    /// Seed, in decimal digits: the numbers of JavaScript do not hold all seeds.
    pub seed: String,
    /// Index of the tree under the seed.
    pub tree: u32,
    /// File name of a digitised tree; `None` grows one.
    pub tree_file: Option<String>,
    /// Units of its lengths and diameters, for MTG files that state none: `mm`, or `mm,0.1mm`.
    pub tree_unit: Option<String>,
    /// Which plant of an MTG file with several.
    pub tree_plant: Option<String>,
    /// The foliage dial \[1\]; `None` keeps the preset's.
    pub foliage: Option<f64>,
    /// Robot, by its name.
    pub robot: String,
    /// Camera at its wrist, by its name; `None` keeps the preset's.
    pub camera: Option<String>,
    /// Name of the controller, `nobody`, or `onnx:` and the name of a network's file.
    pub driver: String,
}

/// The first tree of the first tuning seed, under the expert.
impl Default for Ask {
    fn default() -> Self {
        Self {
            preset: Preset::Paper.name().to_owned(),
            seed: "20250704".to_owned(),
            tree: 0,
            tree_file: None,
            tree_unit: None,
            tree_plant: None,
            foliage: None,
            robot: RobotModel::PAPER.to_owned(),
            camera: None,
            driver: Kind::Expert.name().to_owned(),
        }
    }
}

impl Ask {
    /// Reads options from JSON.
    ///
    /// # Errors
    /// Not JSON, a field unknown or of the wrong kind.
    pub fn from_json(text: &str) -> Result<Self, AskError> {
        serde_json::from_str(text).map_err(|e| AskError(format!("the options cannot be read: {e}")))
    }

    /// The seed as a number.
    ///
    /// # Errors
    /// It is none.
    pub fn seed(&self) -> Result<u64, AskError> {
        let digits = self.seed.bytes().all(|byte| byte.is_ascii_digit());
        let seed = if digits { self.seed.parse().ok() } else { None };
        seed.ok_or_else(|| {
            AskError(format!("seed `{}` is no whole number from 0 to {}", shown(&self.seed), u64::MAX))
        })
    }

    /// The kind of controller that drives; `None` for nobody.
    ///
    /// # Errors
    /// There is none of that name, or a policy whose files are missing or cannot be used.
    fn kind(
        &self,
        parts: &Parts,
        policy: Option<&PolicyFiles>,
    ) -> Result<Option<Arc<dyn ControllerKind>>, AskError> {
        if self.driver.starts_with(POLICY) {
            return policy::kind(&self.driver, policy, parts).map(Some);
        }
        Ok(match self.driver()? {
            Driver::Controller(kind) => Some(Arc::new(kind)),
            Driver::Nobody => None,
        })
    }

    /// The driver, if it is no policy from a file.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn driver(&self) -> Result<Driver, AskError> {
        Driver::named(&self.driver).ok_or_else(|| {
            let names: Vec<&str> = Driver::ALL.iter().map(|driver| driver.name()).collect();
            AskError(format!(
                "driver `{}` is unknown; the drivers are: {}, and {POLICY}FILE.onnx",
                shown(&self.driver),
                names.join(", ")
            ))
        })
    }

    /// Resolves the options, as a scenario resolves the same names; the detector is the default of the camera.
    ///
    /// # Errors
    /// An unknown name, a figure out of its range.
    pub(crate) fn parts(&self) -> Result<Parts, AskError> {
        let preset: Preset = self.preset.parse().map_err(|_| {
            let names = presets().join(", ");
            AskError(format!("preset `{}` is unknown; the presets are: {names}", shown(&self.preset)))
        })?;
        let mut spec = Spec::preset(preset);
        if let Some(foliage) = self.foliage {
            let changed = spec.with_figures("foliage", &[(FOLIAGE, foliage)]);
            spec = changed.map_err(|e| AskError(format!("foliage: {}", e.problem)))?;
        }
        if let Some(camera) = &self.camera {
            spec.camera = CameraSpec::named(&shown(camera)).map_err(AskError)?;
        }
        let robot = RobotModel::named(&shown(&self.robot)).map_err(AskError)?;
        let camera = spec.camera.name();
        let detector =
            DetectorConfig::for_camera(detector_for(camera, false), camera, Some(spec.camera.range()));
        let detector = detector.map_err(AskError)?;
        Ok(Parts { spec: Arc::new(spec), robot: Arc::new(robot), detector })
    }
}

/// Files that a visitor opened.
#[derive(Debug, Clone, Default)]
pub struct Files {
    /// A policy that may drive.
    pub policy: Option<PolicyFiles>,
    /// A digitised tree that may stand in the world.
    pub tree: Option<TreeBytes>,
}

/// Grows the session that the options ask for, with the files that they name.
///
/// # Errors
/// An option or a file that cannot be used, or a world that cannot be built.
pub fn grow(ask: &Ask, files: &Files) -> Result<Tab, AskError> {
    let (seed, parts) = (ask.seed()?, ask.parts()?);
    let kind = ask.kind(&parts, files.policy.as_ref())?;
    let named =
        Named { file: ask.tree_file.as_ref(), unit: ask.tree_unit.as_ref(), plant: ask.tree_plant.as_ref() };
    let tree = tree::read(&named, files.tree.as_ref())?;
    let (spec, own) = (parts.spec, parts.robot.clone());
    let world = match &tree {
        None => World::new(spec, own, seed, ask.tree),
        Some(tree) => {
            let skeleton = tree.skeleton(&spec, seed, ask.tree);
            World::with_tree(spec, own, skeleton, seed, ask.tree, 0)
        }
    };
    let mut world = world.map_err(|e| {
        AskError(match &tree {
            None => format!("tree {} of seed {seed} cannot be built: {e}; take another seed", ask.tree),
            Some(tree) => format!("tree {} cannot be built: {e}", shown(tree.name())),
        })
    })?;
    let (robot, detector) = (parts.robot, parts.detector.clone());
    world.deliver_pictures(kind.as_ref().and_then(|kind| kind.pictures()));
    world.deliver_colour(detector.sees_colour());
    let make = kind.map(|kind| -> Make { Box::new(move || kind.controller(&robot, &detector)) });
    let notes = tree.map(|tree| tree.notes().to_vec()).unwrap_or_default();
    Ok(Tab::new(Session::new(world, make), parts.detector, notes))
}

/// Names of the presets.
fn presets() -> Vec<&'static str> {
    Preset::ALL.iter().map(|preset| preset.name()).collect()
}

/// An overlay that a page offers.
#[derive(Serialize)]
struct MenuOverlay {
    name: &'static str,
    help: &'static str,
}

/// Names and ranges that a page offers.
#[derive(Serialize)]
struct Menu {
    presets: Vec<&'static str>,
    robots: Vec<&'static str>,
    cameras: Vec<&'static str>,
    drivers: Vec<&'static str>,
    /// Lowest and highest foliage.
    foliage: [f64; 2],
    overlays: Vec<MenuOverlay>,
    /// Overlays that are on when a page opens, with commas between.
    overlays_on: &'static str,
    /// Largest file of a network \[bytes\].
    network_max: u64,
    /// Largest file of a tree \[bytes\].
    tree_max: u64,
    defaults: Ask,
}

/// Names and ranges that a page offers, as JSON: `presets`, `robots`, `cameras`, `drivers`, `foliage` (lowest and highest), `overlays`,
/// `overlays_on`, `network_max`, `tree_max` and `defaults`.
pub fn menu() -> String {
    let density: Quantity = Spec::paper().foliage.density;
    let menu = Menu {
        presets: presets(),
        robots: RobotModel::names(),
        cameras: CameraSpec::FILES.iter().map(|(name, _)| *name).collect(),
        drivers: Driver::ALL.iter().map(|driver| driver.name()).collect(),
        foliage: density.range(),
        overlays: Overlay::ALL
            .into_iter()
            .filter(|overlay| *overlay != Overlay::Zones)
            .map(|overlay| MenuOverlay { name: overlay.name(), help: overlay.help() })
            .collect(),
        overlays_on: OVERLAYS,
        network_max: NETWORK_MAX,
        tree_max: orchard_input::TREE,
        defaults: Ask::default(),
    };
    serde_json::to_string(&menu).unwrap_or_else(|e| unreachable!("names and numbers: {e}"))
}

#[cfg(test)]
#[path = "ask_tests.rs"]
mod tests;
