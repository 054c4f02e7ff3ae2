//! The record of one tree's trials.

use std::marker::PhantomData;

use orchard_bench::record::Record;
use serde::{Deserialize, Serialize};

use crate::component::plan::ComponentKey;
use crate::component::task::Component;
use crate::harvest::interface::GaveUp;

/// One tree: all of its trials.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct TreeRecord<C: Component> {
    /// Key: all inputs that determine the record.
    #[serde(flatten)]
    pub key: ComponentKey,
    /// Reason why the world could not be built, if so.
    pub never_built: Option<String>,
    /// Trials in the order of their targets.
    pub trials: Vec<TrialRecord<C::Target>>,
    /// The task.
    #[serde(skip)]
    pub task: PhantomData<C>,
}

/// Outcome of a trial.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum TrialOutcome {
    /// The target was met.
    Success,
    /// The time limit was reached.
    TimeOver,
    /// The robot did not move for too long.
    Stalled,
    /// The world left its plausible state.
    Quarantined {
        /// Problem.
        reason: String,
    },
}

/// One trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrialRecord<T> {
    /// Target.
    pub target: T,
    /// Outcome of the trial.
    pub ended: TrialOutcome,
    /// Simulated time \[s\].
    pub duration_s: f64,
    /// Number of frames.
    pub frames: u32,
    /// Path length of the point between the finger pads in the world, including the base's motion \[m\].
    pub path_m: f64,
    /// Impulse of the robot's contacts with wood \[N s\].
    pub contact_impulse_n_s: f64,
    /// Largest sum of the forces of these contacts \[N\].
    pub peak_contact_force_n: f64,
    /// Largest ratio of bending moment to rupture moment of any joint, including gravity.
    pub peak_moment_ratio: f64,
    /// Largest excess of a joint's ratio over its value at the start.
    pub peak_moment_excess: f64,
    /// Integral over time of the largest excess \[s\].
    pub moment_excess_s: f64,
    /// Ruptures.
    pub branches_snapped: u32,
    /// Fruit that came off its stem, except the named one.
    pub fruit_knocked_off: u32,
    /// Attempts that the controller began.
    pub attempts: u32,
    /// Failure reasons of its attempts, in order.
    pub failures: Vec<String>,
    /// When and why the controller gave up; left out if it did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gave_up: Option<GaveUp>,
}

impl<T> TrialRecord<T> {
    /// True if it met its target.
    pub fn success(&self) -> bool {
        self.ended == TrialOutcome::Success
    }

    /// True if the loads of the trial are valid.
    pub fn sound(&self) -> bool {
        !matches!(self.ended, TrialOutcome::Quarantined { .. })
    }
}

impl<C: Component> Record for TreeRecord<C> {
    type Key = ComponentKey;

    const FOLDER: &'static str = C::NAME;
    const OPTIONAL: &'static [&'static str] = &["backend"];

    fn key(&self) -> &ComponentKey {
        &self.key
    }

    fn file(key: &ComponentKey) -> String {
        format!("{}-{:03}.json", key.seed, key.world)
    }
}
