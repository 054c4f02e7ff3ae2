//! The kind of controller that a policy's files make.

use std::sync::Arc;

use orchard_geometry::math;
use orchard_network::Network;
use orchard_perception::DetectorConfig;
use orchard_picker::{Controller, ControllerKind, Goal};
use orchard_policy::{Encoding, Target};
use orchard_robot::{PictureRequest, RobotModel};
use sha2::{Digest, Sha256};

use crate::controller::LearnedController;
use crate::error::PolicyError;
use crate::policy::Policy;
use crate::spec::Spec;
use crate::wiring::Wiring;

/// The scene that a policy is to act in.
#[derive(Debug, Clone, Copy)]
pub struct Setting<'a> {
    /// The robot.
    pub robot: &'a RobotModel,
    /// Columns and rows of its depth images.
    pub depth_size: [usize; 2],
    /// Frames a second \[Hz\].
    pub frame_rate: f64,
    /// Hash of the scene: world, robot, camera, detector and rules.
    pub scene: &'a str,
}

/// Learned controllers of one policy, for one robot.
#[derive(Clone)]
pub struct LearnedKind {
    name: String,
    policy: Arc<Policy>,
    files: [(&'static str, Arc<[u8]>); 2],
    configs: Vec<(String, String)>,
    notes: Vec<String>,
}

impl LearnedKind {
    /// Names of the files in results: the network and its spec.
    pub const FILES: [&str; 2] = ["policy.onnx", "policy.json"];

    /// Makes controllers of a network and its spec for a robot; `name` is that of the controller.
    ///
    /// # Errors
    /// A network or spec that cannot be read, that do not fit each other, or that were made for another robot, camera or encoding.
    pub fn new(name: &str, onnx: &[u8], spec: &str, setting: &Setting<'_>) -> Result<Self, PolicyError> {
        let (text, spec) = (spec, Spec::read(spec)?);
        if spec.execute == Some(0) {
            return Err(PolicyError::Spec("execute 0: it must be at least 1".to_owned()));
        }
        let encoding = Encoding::new(setting.robot, &spec.spaces, setting.depth_size, setting.frame_rate)?;
        spec.check(encoding.interface())?;
        let network = Network::from_bytes(onnx)?;
        let wiring = Wiring::of(&network, encoding.interface())?;
        let mut notes = Vec::new();
        if spec.scenario != setting.scene {
            notes.push(format!(
                "the policy learned {} in another scene than this one (hash {} instead of {}): other options, or the figures of the simulation \
                 have changed since, and the policy is stale",
                spec.task, spec.scenario, setting.scene
            ));
        }
        let hash = Sha256::digest(onnx).iter().map(|byte| format!("{byte:02x}")).collect::<String>();
        let [of_network, of_spec] = Self::FILES;
        Ok(Self {
            name: name.to_owned(),
            files: [(of_network, onnx.into()), (of_spec, text.as_bytes().into())],
            configs: vec![(format!("{of_network}.sha256"), hash), (of_spec.to_owned(), text.to_owned())],
            policy: Arc::new(Policy { network, wiring, encoding: Arc::new(encoding), spec }),
            notes,
        })
    }
}

impl std::fmt::Debug for LearnedKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {:?}", self.name, self.policy.network)
    }
}

impl ControllerKind for LearnedKind {
    fn name(&self) -> &str {
        &self.name
    }

    fn configs(&self) -> Vec<(String, String)> {
        self.configs.clone()
    }

    fn files(&self) -> Vec<(&str, &[u8])> {
        self.files.iter().map(|(name, bytes)| (*name, &**bytes)).collect()
    }

    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    fn pictures(&self) -> Option<Arc<PictureRequest>> {
        self.policy.encoding.pictures().cloned()
    }

    /// A policy that is told a target keeps still without one.
    fn controller(&self, _: &RobotModel, _: &DetectorConfig) -> Box<dyn Controller> {
        Box::new(LearnedController::new(self.policy.clone(), None))
    }

    fn takes_goals(&self) -> bool {
        self.policy.spec.spaces.target.is_some()
    }

    fn needs_goal(&self) -> bool {
        self.takes_goals()
    }

    fn with_goal(&self, goal: &Goal, _: &RobotModel, _: &DetectorConfig) -> Option<Box<dyn Controller>> {
        let told = told(self.policy.spec.spaces.target?, goal);
        Some(Box::new(LearnedController::new(self.policy.clone(), Some(told))))
    }
}

/// The goal of a trial as a policy is told it, in the form of the target that it learned. A point is told as a fruit without size; a fruit as a point
/// that is approached from where the base stands at the start.
fn told(target: Target, goal: &Goal) -> [f64; 4] {
    let (Goal::Grasp { p_odom: p, .. } | Goal::Reach { p_odom: p, .. }) = goal;
    let last = match (target, goal) {
        (Target::Fruit, Goal::Grasp { radius, .. }) => *radius,
        (Target::Fruit, Goal::Reach { .. }) => 0.0,
        (Target::Point, Goal::Reach { heading_odom, .. }) => *heading_odom,
        (Target::Point, Goal::Grasp { .. }) => math::atan2(p.y, p.x),
    };
    [p.x, p.y, p.z, last]
}

#[cfg(test)]
mod tests {
    use orchard_geometry::Vec3;

    use super::*;

    #[test]
    fn goals_are_told_in_the_form_that_the_policy_learned() {
        let p_odom = Vec3::new(1.0, 1.0, 1.5);
        let (fruit, point) =
            (Goal::Grasp { p_odom, radius: 0.04 }, Goal::Reach { p_odom, heading_odom: -0.3 });
        let last = |target, goal| told(target, goal)[3];
        assert_eq!(told(Target::Fruit, &fruit), [1.0, 1.0, 1.5, 0.04]);
        assert_eq!((last(Target::Fruit, &point), last(Target::Point, &point)), (0.0, -0.3));
        assert!((last(Target::Point, &fruit) - std::f64::consts::FRAC_PI_4).abs() < 1e-15);
    }
}
