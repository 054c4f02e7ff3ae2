//! Robots by name, or from files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use orchard_picker::Kind;
use orchard_robot::{Resources, RobotConfig, RobotModel};
use serde::{Deserialize, Serialize};

use crate::mesh_files::MeshFiles;
use crate::options::is_robot_path;
use crate::{OptionValue, ScenarioError};

/// Files of a robot that does not come with the program, as a result stores them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RobotFiles {
    /// URDF text.
    pub urdf: String,
    /// Config.
    #[serde(deserialize_with = "crate::stored::config")]
    pub config: RobotConfig,
    /// Collision meshes by their names in the URDF: the bytes of the files in base64.
    pub meshes: BTreeMap<String, String>,
}

/// A robot with its name in results and, if it does not come with the program, its files.
pub(crate) struct Found {
    pub robot: Arc<RobotModel>,
    pub name: String,
    pub files: Option<Arc<RobotFiles>>,
}

/// Name that the paper's robot had before there were others; it is still understood.
const FORMER_NAME: &str = "paper";

/// Name of the URDF in a robot's folder, and of its config.
const FILES: [&str; 2] = ["robot.urdf", "robot.toml"];

/// Largest collision meshes of a robot together, which every result stores \[bytes\]. Our own choice: convex hulls need no more.
const MESHES_MAX: usize = 16 << 20;

/// Returns the robot that an option asks for: by the name of a built-in robot, a folder with `robot.urdf` and `robot.toml`, a URDF file with a
/// config of the same name beside it, or a config that changes figures of a built-in robot.
pub(crate) fn find(given: &OptionValue) -> Result<Found, ScenarioError> {
    let given = &match given.value.as_str() {
        FORMER_NAME => OptionValue::new(RobotModel::PAPER, &given.by),
        _ => given.clone(),
    };
    let value = given.value.as_str();
    if RobotModel::names().contains(&value) || !is_robot_path(value) {
        return built_in(given).map(|robot| Found { robot, name: value.to_owned(), files: None });
    }
    let path = Path::new(value);
    let text = |path: &Path, most: u64| {
        // The option names the file already, unless it is one of a folder.
        let of_folder =
            if path == Path::new(value) { String::new() } else { format!("{}: ", path.display()) };
        orchard_input::text(path, most).map_err(|e| given.refuse(format!("{of_folder}{e}")))
    };
    let name = path.file_stem().map_or_else(|| value.to_owned(), |name| name.to_string_lossy().into_owned());
    if path.extension().is_some_and(|extension| extension == "toml") {
        let robot = RobotModel::variant(value, &text(path, orchard_input::CONFIG)?);
        let robot = checked(robot.map_err(|e| given.refuse(e))?, given)?;
        let (urdf, config) = (robot.urdf().to_owned(), robot.config().clone());
        let files = RobotFiles { urdf, config, meshes: BTreeMap::new() };
        return Ok(Found { robot, name, files: Some(Arc::new(files)) });
    }
    let [urdf, config] = match path.extension().is_some_and(|extension| extension == "urdf") {
        true => [path.to_owned(), path.with_extension("toml")],
        false => FILES.map(|file| path.join(file)),
    };
    let urdf_text = text(&urdf, orchard_input::ROBOT)?;
    if !config.is_file() {
        return Err(given.refuse(format!(
            "the robot needs a file {0} with the roles of its joints and links; `orchard robot check --urdf {1} --write-mapping {0}` writes \
             its first draft",
            config.display(),
            urdf.display()
        )));
    }
    let in_config =
        RobotConfig::from_toml(&config.display().to_string(), &text(&config, orchard_input::CONFIG)?);
    let parsed = in_config.map_err(|e| given.refuse(e))?;
    let beside = config.parent().unwrap_or(Path::new(""));
    let packages: Vec<PathBuf> = parsed.package_path.iter().map(|folder| beside.join(folder)).collect();
    let files = MeshFiles::new(&urdf, &packages).map_err(|e| given.refuse(e))?;
    let mut kept = Kept { files, read: BTreeMap::new(), bytes: 0 };
    let robot = RobotModel::load(&urdf_text, &mut kept, &parsed);
    let robot = robot.map_err(|e| given.refuse(format!("{}: {e}", urdf.display())))?;
    let files = RobotFiles { urdf: urdf_text, config: parsed, meshes: kept.read };
    Ok(Found { robot: checked(robot, given)?, name, files: Some(Arc::new(files)) })
}

/// Returns the robot that a result names: the program's own, or the one whose files it stores.
pub(crate) fn of_result(
    given: &OptionValue,
    files: Option<&RobotFiles>,
) -> Result<Arc<RobotModel>, ScenarioError> {
    let Some(files) = files else { return built_in(given) };
    let robot = RobotModel::load(&files.urdf, &mut Stored(&files.meshes), &files.config);
    checked(robot.map_err(|e| given.refuse(e))?, given)
}

fn built_in(given: &OptionValue) -> Result<Arc<RobotModel>, ScenarioError> {
    checked(RobotModel::named(&given.value).map_err(|e| ScenarioError::new(&given.by, e))?, given)
}

fn checked(robot: RobotModel, given: &OptionValue) -> Result<Arc<RobotModel>, ScenarioError> {
    Kind::check_tuning(&robot).map_err(|e| given.refuse(e))?;
    Ok(Arc::new(robot))
}

/// Mesh files that are kept as they are read.
struct Kept {
    files: MeshFiles,
    read: BTreeMap<String, String>,
    bytes: usize,
}

impl Resources for Kept {
    fn read(&mut self, name: &str) -> Result<Vec<u8>, String> {
        let bytes = self.files.read(name)?;
        if !self.read.contains_key(name) {
            self.bytes += bytes.len();
            if self.bytes > MESHES_MAX {
                let most = MESHES_MAX >> 20;
                return Err(format!(
                    "with it the collision meshes have more than {most} MiB, which every result would store: give simpler ones"
                ));
            }
            self.read.insert(name.to_owned(), STANDARD.encode(&bytes));
        }
        Ok(bytes)
    }

    fn find(&mut self, name: &str) -> Result<(), String> {
        self.files.find(name)
    }
}

/// Mesh files that a result stores.
struct Stored<'a>(&'a BTreeMap<String, String>);

impl Resources for Stored<'_> {
    fn read(&mut self, name: &str) -> Result<Vec<u8>, String> {
        let stored = self.0.get(name).ok_or("the result does not store it")?;
        STANDARD.decode(stored).map_err(|e| format!("is not base64: {e}"))
    }

    fn find(&mut self, _: &str) -> Result<(), String> {
        Ok(())
    }
}
