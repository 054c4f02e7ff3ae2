//! Reward, cost and end of a step, and the figures of its episode.

use serde::{Deserialize, Serialize};

use crate::damage::Damage;

/// Largest number of terms of a reward.
pub(crate) const TERMS: usize = 6;

/// Reward, cost and end of a step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Reward.
    pub reward: f64,
    /// Terms of the shaped reward, weighted, in the order of [`crate::Interface::reward`]; zeros follow them.
    pub terms: [f64; TERMS],
    /// Cost: damage of this step.
    pub cost: f64,
    /// True if the task came to its own end: what follows has no value.
    pub terminated: bool,
    /// True if the episode was cut off: time over, robot stalled, or world in quarantine.
    pub truncated: bool,
    /// End of the episode, by the benchmark's word; none while it goes on.
    pub outcome: Option<String>,
    /// True if it ended with the task done.
    pub is_success: bool,
    /// The episode so far.
    pub statistics: Statistics,
}

/// Figures of an episode so far.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Sum of rewards.
    pub total_reward: f64,
    /// Sum of costs.
    pub total_cost: f64,
    /// Actions.
    pub length: u32,
    /// Simulated time \[s\].
    pub time: f64,
    /// Fruit that came to rest in the bucket.
    pub deposited: u32,
    /// Fruit in the bucket by reachable fruit; for a named fruit 1 if it was held.
    pub completeness: f64,
    /// Damage.
    pub damage: Damage,
}

/// End of an episode.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ending {
    pub outcome: &'static str,
    pub terminated: bool,
    pub success: bool,
}

impl Ending {
    pub const STALLED: Self = Self::cut("stalled");
    pub const QUARANTINED: Self = Self::cut("quarantined");
    pub const TIME_OVER: Self = Self::cut("time_over");

    const fn cut(outcome: &'static str) -> Self {
        Self { outcome, terminated: false, success: false }
    }
}
