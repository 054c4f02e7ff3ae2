//! Robots that come with the crate.

use std::sync::OnceLock;

use crate::config::RobotConfig;
use crate::model::RobotModel;

/// A robot that comes with the crate: the content of its folder in `assets/robots/`.
struct BuiltIn {
    name: &'static str,
    urdf: &'static str,
    toml: &'static str,
}

macro_rules! built_in {
    ($name:literal) => {
        BuiltIn {
            name: $name,
            urdf: include_str!(concat!("../assets/robots/", $name, "/robot.urdf")),
            toml: include_str!(concat!("../assets/robots/", $name, "/robot.toml")),
        }
    };
}

/// The robots; the first is the paper's.
const ROBOTS: [BuiltIn; 4] = [
    built_in!("ridgeback-fr3"),
    built_in!("fr3-fixed"),
    built_in!("rail-xarm6-suction"),
    built_in!("husky-ur5e-2f85"),
];

/// The robots that were asked for: each is read once.
static READ: [OnceLock<RobotModel>; ROBOTS.len()] = [const { OnceLock::new() }; ROBOTS.len()];

impl RobotModel {
    /// Name of the paper's robot.
    pub const PAPER: &str = ROBOTS[0].name;

    /// Names of the robots that come with the crate.
    pub fn names() -> Vec<&'static str> {
        ROBOTS.iter().map(|robot| robot.name).collect()
    }

    /// Returns the robot of a name.
    ///
    /// # Errors
    /// There is none of that name; the message lists all names.
    pub fn named(name: &str) -> Result<Self, String> {
        let found = ROBOTS.iter().zip(&READ).find(|(robot, _)| robot.name == name);
        let (BuiltIn { name, urdf, toml }, read) = found
            .ok_or_else(|| format!("no robot '{name}'; the robots are: {}", Self::names().join(", ")))?;
        if let Some(robot) = read.get() {
            return Ok(robot.clone());
        }
        let config =
            RobotConfig::from_toml(&format!("{name}/robot.toml"), toml).map_err(|e| e.to_string())?;
        let robot = Self::from_urdf(urdf, &config).map_err(|e| format!("{name}/robot.urdf: {e}"))?;
        Ok(read.get_or_init(|| robot).clone())
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
