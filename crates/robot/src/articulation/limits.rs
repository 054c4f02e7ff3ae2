//! Limits of joints: those of the description, and those of a limits file.

use super::parts::Limit;
use crate::RobotError;
use crate::plausible::{EFFORT_MAX, POSITION_MAX, SPEED_MAX};
use crate::warning::Warning;
use orchard_quantity::{ConfigError, from_toml};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use urdf_rs::JointType;

/// Limits by joint that complete or replace those of a description.
///
/// As text, a TOML table for each joint with any of `lower`, `upper` (rad or m), `velocity` (rad/s or m/s) and `effort` (N m or N).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Limits {
    joints: BTreeMap<String, Given>,
}

/// Limits of one joint, as far as they are given.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Given {
    lower: Option<f64>,
    upper: Option<f64>,
    velocity: Option<f64>,
    effort: Option<f64>,
}

impl Limits {
    /// Reads a limits file; `file` names the text in errors.
    ///
    /// # Errors
    /// The text is not TOML, a field is unknown or no number, or a value is outside its range: positions within 1e3, `velocity` above 0 and up to
    /// 1e6, `effort` above 0 and up to 1e9, `lower` below `upper`.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, ConfigError> {
        from_toml::<Self>(file, text)?.checked(file)
    }

    /// Checks the ranges of all values; `file` names the text in errors.
    pub(crate) fn checked(self, file: &str) -> Result<Self, ConfigError> {
        for (joint, given) in &self.joints {
            given.check().map_err(|(field, problem)| ConfigError {
                file: file.to_owned(),
                field: format!("{joint}.{field}"),
                problem,
            })?;
        }
        Ok(self)
    }

    /// Refuses names of joints that a description does not have, or has fixed.
    pub(super) fn check_names(&self, joints: &[urdf_rs::Joint]) -> Result<(), RobotError> {
        let by = || "limits file".to_owned();
        let moves = |j: &&urdf_rs::Joint| {
            matches!(j.joint_type, JointType::Revolute | JointType::Continuous | JointType::Prismatic)
        };
        let names: std::collections::BTreeSet<&str> =
            joints.iter().filter(moves).map(|j| j.name.as_str()).collect();
        match self.joints.keys().find(|name| !names.contains(name.as_str())) {
            Some(name) => Err(RobotError::MissingJoint { by: by(), kind: "one-axis", joint: name.clone() }),
            None => Ok(()),
        }
    }
}

impl Given {
    fn check(&self) -> Result<(), (&'static str, String)> {
        for (field, value) in [("lower", self.lower), ("upper", self.upper)] {
            if let Some(x) = value.filter(|x| x.is_nan() || x.abs() > POSITION_MAX) {
                return Err((field, format!("{x} is outside {:e} to {POSITION_MAX:e}", -POSITION_MAX)));
            }
        }
        for (field, value, most) in
            [("velocity", self.velocity, SPEED_MAX), ("effort", self.effort, EFFORT_MAX)]
        {
            if let Some(x) = value.filter(|x| x.is_nan() || *x <= 0.0 || *x > most) {
                return Err((field, format!("{x} is not above 0 and up to {most:e}")));
            }
        }
        match (self.lower, self.upper) {
            (Some(lower), Some(upper)) if lower >= upper => {
                Err(("lower", format!("{lower} is not below `upper`, {upper}")))
            }
            _ => Ok(()),
        }
    }
}

/// Freedom that limits leave to a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Room {
    /// The joint moves within limits.
    Within(Limit),
    /// The joint has one position.
    At(f64),
}

/// Limits of a hinge or slide. `stated` tells which limits the file states: lower, upper, velocity, effort.
///
/// A limit that is absent, zero where it must be positive, or beyond any robot counts as none, with a warning. Positions that are both zero
/// count as none where speed and effort are zero or absent, too: that is how files without limits are filled in.
pub(super) fn limit_of(
    joint: &urdf_rs::Joint,
    stated: [bool; 4],
    limits: &Limits,
    warnings: &mut Vec<Warning>,
) -> Result<Room, RobotError> {
    let urdf = &joint.limit;
    let place = format!("limits of joint `{}`", joint.name);
    if [urdf.lower, urdf.upper, urdf.velocity, urdf.effort].iter().any(|x| x.is_nan()) {
        return Err(RobotError::NotFinite { place });
    }
    let given = limits.joints.get(&joint.name).copied().unwrap_or_default();
    let positive = |x: f64, is_stated: bool, most: f64| (is_stated && x > 0.0 && x <= most).then_some(x);
    let velocity = given.velocity.or(positive(urdf.velocity, stated[2], SPEED_MAX));
    let effort = given.effort.or(positive(urdf.effort, stated[3], EFFORT_MAX));
    let turns_freely = joint.joint_type == JointType::Continuous;
    let is_blank = urdf.lower == 0.0 && urdf.upper == 0.0 && velocity.is_none() && effort.is_none();
    let usable = |x: f64| x.abs() <= POSITION_MAX;
    let urdf_range = (!turns_freely && !is_blank && (stated[0] || stated[1]))
        .then_some((urdf.lower, urdf.upper))
        .filter(|(lower, upper)| usable(*lower) && usable(*upper));
    let lower = given.lower.or(urdf_range.map(|r| r.0));
    let upper = given.upper.or(urdf_range.map(|r| r.1));
    if let (Some(lower), Some(upper)) = (lower, upper)
        && lower > upper
    {
        let problem = "its lowest position is above its highest; --limits FILE can correct them";
        return Err(RobotError::Limit { joint: joint.name.clone(), problem });
    }
    if lower.is_some() && lower == upper {
        return Ok(Room::At(lower.unwrap_or_default()));
    }
    let range_lacks = !turns_freely && (lower.is_none() || upper.is_none());
    let lacks = [("position", range_lacks), ("velocity", velocity.is_none()), ("effort", effort.is_none())];
    let lacks: Vec<&str> = lacks.into_iter().filter(|(_, lacks)| *lacks).map(|(name, _)| name).collect();
    if !lacks.is_empty() {
        warnings.push(Warning::NoLimit { joint: joint.name.clone(), lacks });
    }
    Ok(Room::Within(Limit {
        lower: lower.unwrap_or(Limit::NONE.lower),
        upper: upper.unwrap_or(Limit::NONE.upper),
        velocity: velocity.unwrap_or(Limit::NONE.velocity),
        effort: effort.unwrap_or(Limit::NONE.effort),
    }))
}
