//! Resolves options to a scenario.

use std::path::Path;
use std::sync::Arc;

use orchard_learned::NETWORK_MAX;
use orchard_perception::config::LEARNED;
use orchard_perception::{DetectorConfig, Onnx, detector_for};
use orchard_picker::{ControllerKind, Kind};
use orchard_quantity::{from_table, overlay, parse};
use orchard_robot::RobotModel;
use orchard_spec::camera::CameraSpec;
use orchard_spec::randomisation::Axis;
use orchard_spec::{Preset, Spec};

use crate::figures::Layers;
use crate::limits;
use crate::options::names_file;
use crate::robot;
use crate::{Names, OptionValue, Options, Scenario, ScenarioError, SceneNames, TreeFile, tree};

/// Names of the robots.
pub fn robots() -> Vec<&'static str> {
    RobotModel::names()
}

/// Names of the presets.
pub fn presets() -> Vec<&'static str> {
    Preset::ALL.iter().map(|preset| preset.name()).collect()
}

/// Names of the cameras.
pub fn cameras() -> Vec<&'static str> {
    CameraSpec::FILES.iter().map(|(name, _)| *name).collect()
}

/// The controllers of this project.
pub fn controllers() -> Vec<Arc<dyn ControllerKind>> {
    Kind::ALL.iter().map(|kind| Arc::new(*kind) as Arc<dyn ControllerKind>).collect()
}

impl Scenario {
    /// Resolves options: reads the named files, looks up all names, and checks every figure. `controllers` are those of the program.
    ///
    /// # Errors
    /// An unknown name, a file that cannot be read, a figure out of its range; the error names the option.
    pub fn resolve(
        options: &Options,
        controllers: &[Arc<dyn ControllerKind>],
    ) -> Result<Self, ScenarioError> {
        let (mut spec, mut layers) = world(options)?;
        let (mut randomisation, mut camera) = (SceneNames::OF_PRESET.to_owned(), None);
        if let Some(given) = &options.randomisation {
            randomise(&mut spec, given)?;
            randomisation = file_name(&given.value);
            layers.part("world.randomisation", &given.by);
        }
        if let Some(given) = &options.camera {
            spec.camera = named_or_file(given, CameraSpec::named, |file, text| {
                CameraSpec::from_toml(file, text).map_err(|e| e.to_string())
            })?;
            camera = Some(file_name(&given.value));
            layers.part("world.camera", &given.by);
        }
        let camera = camera.unwrap_or_else(|| spec.camera.name().to_owned());
        let by_camera = || {
            OptionValue::new(
                detector_for(spec.camera.name(), false),
                format!("the detector for camera {camera}"),
            )
        };
        let detector = options.detector.clone().unwrap_or_else(by_camera);
        let detector_config = self::detector(&detector, spec.camera.name())?;
        layers.part("detector", &detector.by);
        let default = |value: &str| OptionValue::new(value, "default");
        let robot = options.robot.clone().unwrap_or_else(|| default(RobotModel::PAPER));
        layers.part("robot", &robot.by);
        let robot = robot::find(&robot)?;
        let controller = options.controller.clone().unwrap_or_else(|| default(Kind::default().name()));
        layers.part("controller", &controller.by);
        let tree = read_tree(options)?;
        if let Some((field, problem)) = limits::of_world(&spec) {
            let files = [&options.config, &options.camera, &options.randomisation];
            let by = files.into_iter().flatten().next().map_or("world", |given| &given.by);
            return Err(ScenarioError::new(format!("{by}: {field}"), problem));
        }
        let scenario = Self {
            names: Names {
                scene: SceneNames {
                    preset: spec.preset.clone(),
                    tree: tree.as_ref().map_or(SceneNames::GROWN, TreeFile::name).to_owned(),
                    randomisation,
                    robot: robot.name,
                    camera,
                    detector: file_name(&detector.value),
                },
                controller: String::new(),
            },
            spec: Arc::new(spec),
            tree: tree.map(Arc::new),
            robot: robot.robot,
            robot_files: robot.files,
            detector: detector_config,
            detector_by_default: options.detector.is_none(),
            controller: Arc::new(Kind::default()),
            rules: options.rules.as_ref().map(|(_, rules)| rules.clone()).unwrap_or_default(),
            layers,
        };
        scenario.under_option(&controller, controllers)
    }
}

/// A detector by its name or from its file. One with a network, or a file based on it, fits spheres with the figures of the detector of the camera of a name. The
/// network of a file is read.
///
/// # Errors
/// No such name or file, a figure out of its range, or a network that cannot be used.
pub fn detector(given: &OptionValue, camera: &str) -> Result<DetectorConfig, ScenarioError> {
    let named = |name: &str| for_camera(name, camera);
    let config = named_or_file(given, named, |file, text| {
        let mut config = detector_of_file(file, text, camera)?;
        let onnx = config.network.as_mut().map(|network| &mut network.onnx);
        if let Some((onnx, name)) =
            onnx.and_then(|onnx| onnx.file().map(str::to_owned).map(|name| (onnx, name)))
        {
            let path = Path::new(file).with_file_name(name);
            let bytes = orchard_input::bytes(&path, NETWORK_MAX).map_err(|e| e.to_string());
            let read = bytes.and_then(Onnx::from_bytes);
            *onnx = read.map_err(|e| format!("{file}: network.onnx: {}: {e}", path.display()))?;
        }
        Ok(config)
    })?;
    match limits::of_detector(&config) {
        Some((field, problem)) => Err(given.refuse(format!("{field}: {problem}"))),
        None => Ok(config),
    }
}

/// The detector of a name for the camera of a name.
fn for_camera(name: &str, camera: &str) -> Result<DetectorConfig, String> {
    DetectorConfig::for_camera(name, camera, CameraSpec::named(camera).ok().map(|camera| camera.range()))
}

/// A detector from the text of a file.
fn detector_of_file(file: &str, text: &str, camera: &str) -> Result<DetectorConfig, String> {
    let mut above = parse(file, text).map_err(|e| e.to_string())?;
    let base = above.get("base").and_then(toml::Value::as_str).filter(|base| LEARNED.contains(base));
    let Some(base) = base else { return DetectorConfig::from_toml(file, text).map_err(|e| e.to_string()) };
    let mut table = toml::Table::try_from(for_camera(base, camera)?).map_err(|e| e.to_string())?;
    above.remove("base");
    overlay(&mut table, above, &[]);
    from_table(file, table).map_err(|e| e.to_string())
}

/// The world's config and its layers.
fn world(options: &Options) -> Result<(Spec, Layers), ScenarioError> {
    match (&options.preset, &options.config) {
        (Some(preset), Some(config)) => Err(ScenarioError::new(
            format!("{} and {}", preset.by, config.by),
            "only one of the two may be given; a config file names its preset in the field `base`",
        )),
        (_, Some(config)) => {
            let text = read(config)?;
            let spec = Spec::from_toml(&config.value, &text)
                .map_err(|e| ScenarioError::new(&config.by, e.to_string()))?;
            let layers = Layers::of_config(&config.value, &text, &spec);
            Ok((spec, layers))
        }
        (preset, None) => {
            let preset = match preset {
                None => Preset::Paper,
                Some(given) => given.value.parse().map_err(|e| given_error(given, e))?,
            };
            let spec = Spec::preset(preset);
            let layers = Layers::of_config(preset.name(), preset.toml(), &spec);
            Ok((spec, layers))
        }
    }
}

/// Sets the randomisation: one strength for every axis, or figures of a file that override the preset's.
fn randomise(spec: &mut Spec, given: &OptionValue) -> Result<(), ScenarioError> {
    if names_file(&given.value) {
        let above = parse(&given.value, &read(given)?).map_err(|e| given_error(given, e))?;
        let below = toml::Table::try_from(&spec.randomisation);
        let mut table = below.map_err(|e| given_error(given, e))?;
        overlay(&mut table, above, &[]);
        spec.randomisation = from_table(&given.value, table).map_err(|e| ScenarioError::new(&given.by, e))?;
        return Ok(());
    }
    let strength = given.value.parse().ok().filter(|strength| (0.0..=1.0).contains(strength));
    let strength =
        strength.ok_or_else(|| given.refuse("must be a strength in [0, 1] or the name of a .toml file"))?;
    for &axis in Axis::ALL {
        let dial = spec.randomisation.strength_mut(axis);
        *dial = dial.with_value(strength).map_err(|e| given_error(given, e))?;
    }
    Ok(())
}

fn read_tree(options: &Options) -> Result<Option<TreeFile>, ScenarioError> {
    let Some(given) = &options.tree else {
        let extra = [&options.tree_unit, &options.tree_plant].into_iter().flatten().next();
        return extra.map_or(Ok(None), |extra| {
            Err(extra.refuse("there is no digitised tree: --tree FILE gives one"))
        });
    };
    let value = |option: &Option<OptionValue>| option.as_ref().map(|given| given.value.clone());
    let file = tree::read(Path::new(&given.value), value(&options.tree_unit), value(&options.tree_plant));
    file.map(Some).map_err(|e| given.refuse(e))
}

/// Finds a part by its name, or reads it from the text of its file.
fn named_or_file<T>(
    given: &OptionValue,
    named: impl FnOnce(&str) -> Result<T, String>,
    from_toml: impl FnOnce(&str, &str) -> Result<T, String>,
) -> Result<T, ScenarioError> {
    if !names_file(&given.value) {
        return named(&given.value).map_err(|e| given_error(given, e));
    }
    from_toml(&given.value, &read(given)?).map_err(|e| given_error(given, e))
}

fn read(given: &OptionValue) -> Result<String, ScenarioError> {
    orchard_input::text(Path::new(&given.value), orchard_input::CONFIG).map_err(|e| given.refuse(e))
}

fn given_error(given: &OptionValue, problem: impl ToString) -> ScenarioError {
    ScenarioError::new(&given.by, problem)
}

/// Returns a name unchanged, and of a path the file name.
fn file_name(value: &str) -> String {
    let path = Path::new(value);
    let last = path.file_name().filter(|_| names_file(value));
    last.map_or_else(|| value.to_owned(), |name| name.to_string_lossy().into_owned())
}
