//! The spec beside a network: the interface in which it learned.

use orchard_policy::{Interface, Spaces};
use serde::Deserialize;
use serde_json::Value;

use crate::error::PolicyError;

/// The spec of a policy. Its fields are those of the `interface` of an environment, so that a training script writes that as it is; fields
/// that are not listed here are not read.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Spec {
    /// Robot.
    pub robot: String,
    /// Task that was learned.
    pub task: String,
    /// Hash of the scene in which the policy learned: world, robot, camera, detector and rules.
    pub scenario: String,
    /// Version of the scales of actions.
    pub encoding: String,
    /// Observations and actions.
    pub spaces: Spaces,
    /// The numbers of an action.
    action: Vec<Value>,
    /// The arrays of an observation.
    observation: Vec<Value>,
    /// Of a network that gives several actions at a time: number of actions that are carried out before it is asked again; without it, all.
    #[serde(default)]
    pub execute: Option<u32>,
}

impl Spec {
    /// Reads JSON text.
    ///
    /// # Errors
    /// Not JSON, or a field that is missing or of another type.
    pub fn read(text: &str) -> Result<Self, PolicyError> {
        serde_json::from_str(text).map_err(|e| PolicyError::Spec(e.to_string()))
    }

    /// Checks that the interface is the one of the robot.
    ///
    /// # Errors
    /// The first difference.
    pub fn check(&self, own: &Interface) -> Result<(), PolicyError> {
        let differs = |problem| PolicyError::Interface { robot: self.robot.clone(), problem };
        if self.encoding != own.encoding {
            let problem = format!("encoding {} instead of {}", self.encoding, own.encoding);
            return Err(differs(problem));
        }
        let own = serde_json::to_value(own).map_err(|e| differs(e.to_string()))?;
        for (field, name, given) in
            [("action", "name", &self.action), ("observation", "key", &self.observation)]
        {
            let own = own[field].as_array().map_or(&[][..], Vec::as_slice);
            let differing = given.iter().zip(own).find(|(given, own)| !same(given, own));
            if let Some((given, own)) = differing {
                let (a, b) = (first_difference(given, own), first_difference(own, given));
                return Err(differs(format!("{field} {}: {a} instead of {b}", text(&given[name]))));
            }
            if given.len() != own.len() {
                return Err(differs(format!("{} entries of {field} instead of {}", given.len(), own.len())));
            }
        }
        Ok(())
    }
}

/// Fields of an entry that decide what its numbers are; the others are words for people.
const DECIDE: [&str; 9] =
    ["name", "key", "unit", "at_minus_one", "at_plus_one", "dtype", "shape", "elements", "low"];

fn same(a: &Value, b: &Value) -> bool {
    DECIDE.iter().all(|field| a[field] == b[field])
}

/// The first deciding field in which an entry differs from another, with its value.
fn first_difference(a: &Value, b: &Value) -> String {
    let field = DECIDE.iter().find(|field| a[**field] != b[**field]).unwrap_or(&"name");
    format!("{field} {}", text(&a[*field]))
}

fn text(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
