//! Robots that come with the crate.

use std::sync::OnceLock;

use orchard_quantity::parse;

use crate::assets::{self, BuiltIn, ROBOTS};
use crate::config::RobotConfig;
use crate::model::RobotModel;

/// The robots that were asked for: each is read once.
static READ: [OnceLock<RobotModel>; ROBOTS.len()] = [const { OnceLock::new() }; ROBOTS.len()];

impl RobotModel {
    /// Name of the paper's robot.
    pub const PAPER: &str = ROBOTS[0].name;

    /// Names of the robots that come with the crate.
    pub fn names() -> Vec<&'static str> {
        assets::names()
    }

    /// Returns the robot of a name.
    ///
    /// # Errors
    /// There is none of that name; the message lists all names.
    pub fn named(name: &str) -> Result<Self, String> {
        let BuiltIn { urdf, toml, .. } = assets::find(name)?;
        let read = ROBOTS.iter().zip(&READ).find_map(|(robot, read)| (robot.name == name).then_some(read));
        if let Some(robot) = read.and_then(OnceLock::get) {
            return Ok(robot.clone());
        }
        let config =
            RobotConfig::from_toml(&format!("{name}/robot.toml"), toml).map_err(|e| e.to_string())?;
        let robot = Self::from_urdf(urdf, &config).map_err(|e| format!("{name}/robot.urdf: {e}"))?;
        Ok(read.map_or(robot.clone(), |read| read.get_or_init(|| robot).clone()))
    }

    /// Returns a built-in robot with other figures: `text` is a config whose field `base` is the robot's name and that holds what differs; `file`
    /// names the config in errors.
    ///
    /// # Errors
    /// The text is no such config, or the figures do not fit the robot's URDF.
    pub fn variant(file: &str, text: &str) -> Result<Self, String> {
        let table = parse(file, text).map_err(|e| e.to_string())?;
        let base = table.get("base").and_then(|base| base.as_str()).unwrap_or_default();
        let BuiltIn { urdf, .. } = assets::find(base).map_err(|e| format!("{file}: base: {e}"))?;
        let config = RobotConfig::from_toml(file, text).map_err(|e| e.to_string())?;
        Self::from_urdf(urdf, &config).map_err(|e| format!("{file}: {e}"))
    }

    /// The paper's robot, `ridgeback-fr3`.
    ///
    /// # Panics
    /// Never: the embedded files are read in this crate's tests.
    pub fn paper() -> Self {
        Self::named(Self::PAPER).unwrap_or_else(|e| unreachable!("embedded robot: {e}"))
    }
}

impl RobotConfig {
    /// The config of the paper's robot.
    ///
    /// # Panics
    /// Never: the embedded file is read in this crate's tests.
    pub fn paper() -> Self {
        RobotModel::paper().config().clone()
    }
}

/// URDF text of the paper's robot.
pub const PAPER_URDF: &str = ROBOTS[0].urdf;

/// Config of the paper's robot as TOML text.
pub const PAPER_TOML: &str = ROBOTS[0].toml;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_robot_has_all_its_parts() {
        for name in RobotModel::names() {
            let robot = RobotModel::named(name).unwrap();
            assert!((4..=8).contains(&robot.kinematics().dof()), "{name}");
        }
        let e = RobotModel::named("lemon").unwrap_err();
        assert!(e.starts_with("no robot 'lemon'; the robots are: ridgeback-fr3, "), "{e}");
    }
}
