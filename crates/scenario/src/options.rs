//! Options of a scenario as the user gave them, before names are looked up.

use std::path::Path;

use orchard_perception::detector_for;
use serde::Deserialize;

use crate::names::POLICY;
use crate::{Names, ScenarioError, SceneNames};

/// A value with the option that gave it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OptionValue {
    /// The value: a name, a number or a file.
    pub value: String,
    /// The option (`--camera`), or file and field.
    pub by: String,
}

impl OptionValue {
    /// A value given by an option.
    pub fn new(value: impl Into<String>, by: impl Into<String>) -> Self {
        Self { value: value.into(), by: by.into() }
    }

    /// An error that names the option and the value.
    pub(crate) fn refuse(&self, problem: impl ToString) -> ScenarioError {
        ScenarioError::new(format!("{} {}", self.by, self.value), problem)
    }
}

/// Options of a scenario; the defaults are the preset `paper` and the controller `baseline`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Name of a preset. Excludes `config`.
    pub preset: Option<OptionValue>,
    /// Config file of the world. Excludes `preset`.
    pub config: Option<OptionValue>,
    /// File of a digitised tree.
    pub tree: Option<OptionValue>,
    /// Units of that file, `LENGTH` or `LENGTH,DIAMETER`.
    pub tree_unit: Option<OptionValue>,
    /// Plant of that file.
    pub tree_plant: Option<OptionValue>,
    /// Strength of every axis of the randomisation in [0, 1], or a file of changed figures.
    pub randomisation: Option<OptionValue>,
    /// Name of a robot, its folder, or its URDF file.
    pub robot: Option<OptionValue>,
    /// Name of a camera, or its file.
    pub camera: Option<OptionValue>,
    /// Name of a detector, or its file.
    pub detector: Option<OptionValue>,
    /// Name of a controller, or `onnx:` and the file of a policy's network.
    pub controller: Option<OptionValue>,
    /// Changed figures of the protocol, with the file that gave them.
    pub rules: Option<(String, toml::Table)>,
}

/// A scenario file. Paths in it are relative to its folder.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScenarioFile {
    preset: Option<String>,
    config: Option<String>,
    tree: Option<String>,
    tree_unit: Option<String>,
    tree_plant: Option<String>,
    randomisation: Option<Strength>,
    robot: Option<String>,
    camera: Option<String>,
    detector: Option<String>,
    controller: Option<String>,
    rules: Option<toml::Table>,
}

/// The randomisation of a scenario file: a number or a file.
#[derive(Deserialize)]
#[serde(untagged)]
enum Strength {
    Whole(i64),
    Number(f64),
    File(String),
}

/// True if the value of a robot's option is a path: that of a URDF file or of a folder.
pub(crate) fn is_robot_path(value: &str) -> bool {
    let path = Path::new(value);
    path.components().count() > 1
        || path.extension().is_some_and(|extension| extension == "urdf" || extension == "toml")
        || path.is_dir()
}

impl Options {
    /// Reads a scenario file.
    ///
    /// # Errors
    /// The file cannot be read, is not TOML, or has an unknown field.
    pub fn from_file(path: &Path) -> Result<Self, ScenarioError> {
        let name = path.display().to_string();
        let text = orchard_input::text(path, orchard_input::CONFIG);
        let text = text.map_err(|e| ScenarioError::new(&name, e))?;
        let file: ScenarioFile = orchard_quantity::from_toml(&name, &text)
            .map_err(|e| ScenarioError::new(format!("{}: {}", e.file, e.field), e.problem))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let given = |field: &str, value: Option<String>| {
            value.map(|value| OptionValue { value, by: format!("{name}: {field}") })
        };
        let beside = |field: &str, value: Option<String>| {
            let value = value.map(|file| if names_file(&file) { under(folder, &file) } else { file });
            given(field, value)
        };
        let randomisation = file.randomisation.map(|strength| match strength {
            Strength::Whole(whole) => whole.to_string(),
            Strength::Number(number) => number.to_string(),
            Strength::File(file) => file,
        });
        let by_itself = |field: &str, value: Option<String>| given(field, value.map(|f| under(folder, &f)));
        Ok(Self {
            preset: given("preset", file.preset),
            config: by_itself("config", file.config),
            tree: by_itself("tree", file.tree),
            tree_unit: given("tree_unit", file.tree_unit),
            tree_plant: given("tree_plant", file.tree_plant),
            randomisation: beside("randomisation", randomisation),
            robot: given(
                "robot",
                file.robot.map(|robot| if is_robot_path(&robot) { under(folder, &robot) } else { robot }),
            ),
            camera: beside("camera", file.camera),
            detector: beside("detector", file.detector),
            controller: given(
                "controller",
                file.controller.map(|value| match value.strip_prefix(POLICY) {
                    Some(path) => format!("{POLICY}{}", under(folder, path)),
                    None => value,
                }),
            ),
            rules: file.rules.map(|rules| (name.clone(), rules)),
        })
    }

    /// Merges these options over others: values given here take precedence.
    #[must_use]
    pub fn over(self, below: Self) -> Self {
        let world = self.preset.is_some() || self.config.is_some();
        let tree = self.tree.is_some();
        Self {
            preset: self.preset.or(below.preset.filter(|_| !world)),
            config: self.config.or(below.config.filter(|_| !world)),
            tree: self.tree.or(below.tree),
            tree_unit: self.tree_unit.or(below.tree_unit.filter(|_| !tree)),
            tree_plant: self.tree_plant.or(below.tree_plant.filter(|_| !tree)),
            randomisation: self.randomisation.or(below.randomisation),
            robot: self.robot.or(below.robot),
            camera: self.camera.or(below.camera),
            detector: self.detector.or(below.detector),
            controller: self.controller.or(below.controller),
            rules: self.rules.or(below.rules),
        }
    }

    /// Options by their names on command lines, without the dashes.
    ///
    /// # Errors
    /// An unknown option name.
    pub fn of(pairs: &[(&str, &str)]) -> Result<Self, ScenarioError> {
        let mut options = Self::default();
        for &(name, value) in pairs {
            let by = format!("--{name}");
            let field = match name {
                "preset" => &mut options.preset,
                "config" => &mut options.config,
                "tree" => &mut options.tree,
                "tree-unit" => &mut options.tree_unit,
                "tree-plant" => &mut options.tree_plant,
                "randomisation" => &mut options.randomisation,
                "robot" => &mut options.robot,
                "camera" => &mut options.camera,
                "detector" => &mut options.detector,
                "controller" => &mut options.controller,
                _ => return Err(ScenarioError::new(by, "unknown option of a scenario")),
            };
            *field = Some(OptionValue::new(value, by));
        }
        Ok(options)
    }

    /// Builds the options for the parts with these names, if all parts are built in.
    ///
    /// # Errors
    /// A part that was read from a file, or a digitised tree.
    pub fn of_names(names: &Names) -> Result<Self, ScenarioError> {
        let mut pairs = vec![("controller", names.controller.as_str())];
        for (option, name) in names.scene.list() {
            let kept = match option {
                "tree" => name == SceneNames::GROWN,
                "randomisation" => name == SceneNames::OF_PRESET,
                "detector" => name == detector_for(&names.scene.camera, false),
                _ => false,
            };
            if kept {
                continue;
            }
            if option == "tree" || names_file(name) {
                return Err(ScenarioError::new(
                    format!("--{option} {name}"),
                    "the result was made with this file: give this option, or keep the result's plan.json in its folder",
                ));
            }
            pairs.push((option, name));
        }
        Self::of(&pairs)
    }

    /// True if no option is given.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// True if a value is a file name and not a built-in part.
pub(crate) fn names_file(value: &str) -> bool {
    value.ends_with(".toml")
}

fn under(folder: &Path, file: &str) -> String {
    folder.join(file).display().to_string()
}
