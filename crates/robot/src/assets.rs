//! Files of the robots that come with the crate.

/// Surfaces and inverse kinematics of no robot in particular: the base that configs of robots name.
const COMMON_TOML: &str = include_str!("../assets/robots/common.toml");

/// A robot that comes with the crate: the content of its folder in `assets/robots/`.
pub(crate) struct BuiltIn {
    pub name: &'static str,
    pub urdf: &'static str,
    pub toml: &'static str,
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
pub(crate) const ROBOTS: [BuiltIn; 4] = [
    built_in!("ridgeback-fr3"),
    built_in!("fr3-fixed"),
    built_in!("rail-xarm6-suction"),
    built_in!("husky-ur5e-2f85"),
];

/// Returns the robot of a name.
///
/// # Errors
/// There is none of that name; the message lists all names.
pub(crate) fn find(name: &str) -> Result<&'static BuiltIn, String> {
    let found = ROBOTS.iter().find(|robot| robot.name == name);
    found.ok_or_else(|| format!("no robot '{name}'; the robots are: {}", names().join(", ")))
}

/// Names of the robots.
pub(crate) fn names() -> Vec<&'static str> {
    ROBOTS.iter().map(|robot| robot.name).collect()
}

/// TOML text of a config that other configs name as their base.
pub(crate) fn base_text(name: &str) -> Result<&'static str, String> {
    match find(name) {
        _ if name == "common" => Ok(COMMON_TOML),
        Ok(robot) => Ok(robot.toml),
        Err(_) => Err(format!(
            "no robot config '{name}'; those that can be a base are: common, {}",
            names().join(", ")
        )),
    }
}
