//! Options of a session as a page gives them: JSON with names and numbers.

use std::sync::Arc;

use orchard_perception::DetectorConfig;
use orchard_picker::Kind;
use orchard_play::{Make, Overlay, Session};
use orchard_quantity::Quantity;
use orchard_robot::RobotModel;
use orchard_spec::{Preset, Spec};
use orchard_world::World;
use serde::{Deserialize, Serialize};

use crate::driver::Driver;
use crate::tab::{OVERLAYS, Tab};

/// The foliage dial in a world's config.
const FOLIAGE: &str = "foliage.density";

/// An option that cannot be used; the message names it, its value and what is allowed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct AskError(pub String);

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
    /// The foliage dial \[1\]; `None` keeps the preset's.
    pub foliage: Option<f64>,
    /// Name of the controller, or `nobody`.
    pub driver: String,
}

/// The first tree of the first tuning seed, under the expert.
impl Default for Ask {
    fn default() -> Self {
        Self {
            preset: Preset::Paper.name().to_owned(),
            seed: "20250704".to_owned(),
            tree: 0,
            foliage: None,
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

    /// The driver.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn driver(&self) -> Result<Driver, AskError> {
        Driver::named(&self.driver).ok_or_else(|| {
            let names: Vec<&str> = Driver::ALL.iter().map(|driver| driver.name()).collect();
            AskError(format!(
                "driver `{}` is unknown; the drivers are: {}",
                shown(&self.driver),
                names.join(", ")
            ))
        })
    }

    /// Resolves the options, as a scenario resolves the same names: the paper's robot, the preset's camera, and the detector of that camera.
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
        let detector = DetectorConfig::named(spec.camera.name()).unwrap_or_else(|_| DetectorConfig::paper());
        Ok(Parts { spec: Arc::new(spec), robot: Arc::new(RobotModel::paper()), detector })
    }
}

/// Parts of a session.
#[derive(Debug)]
pub(crate) struct Parts {
    pub spec: Arc<Spec>,
    pub robot: Arc<RobotModel>,
    pub detector: DetectorConfig,
}

/// Grows the session that the options ask for.
///
/// # Errors
/// An option that cannot be used, or a world that cannot be built.
pub fn grow(ask: &Ask) -> Result<Tab, AskError> {
    let (seed, driver, parts) = (ask.seed()?, ask.driver()?, ask.parts()?);
    let world = World::new(parts.spec, parts.robot.clone(), seed, ask.tree);
    let world = world.map_err(|e| {
        AskError(format!("tree {} of seed {seed} cannot be built: {e}; take another seed", ask.tree))
    })?;
    let (robot, detector) = (parts.robot, parts.detector.clone());
    let make: Option<Make> = match driver {
        Driver::Controller(kind) => Some(Box::new(move || kind.controller(&robot, detector.clone()))),
        Driver::Nobody => None,
    };
    Ok(Tab::new(Session::new(world, make), parts.detector))
}

/// Names of the presets.
fn presets() -> Vec<&'static str> {
    Preset::ALL.iter().map(|preset| preset.name()).collect()
}

/// The beginning of a text from a link, for a message.
fn shown(text: &str) -> String {
    const MOST: usize = 40;
    text.chars().take(MOST).collect()
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
    drivers: Vec<&'static str>,
    /// Lowest and highest foliage.
    foliage: [f64; 2],
    overlays: Vec<MenuOverlay>,
    /// Overlays that are on when a page opens, with commas between.
    overlays_on: &'static str,
    defaults: Ask,
}

/// Names and ranges that a page offers, as JSON: `presets`, `drivers`, `foliage` (lowest and highest), `overlays`,
/// `overlays_on` and `defaults`.
pub fn menu() -> String {
    let density: Quantity = Spec::paper().foliage.density;
    let menu = Menu {
        presets: presets(),
        drivers: Driver::ALL.iter().map(|driver| driver.name()).collect(),
        foliage: density.range(),
        overlays: Overlay::ALL
            .map(|overlay| MenuOverlay { name: overlay.name(), help: overlay.help() })
            .into(),
        overlays_on: OVERLAYS,
        defaults: Ask::default(),
    };
    serde_json::to_string(&menu).unwrap_or_else(|e| unreachable!("names and numbers: {e}"))
}

#[cfg(test)]
#[path = "ask_tests.rs"]
mod tests;
