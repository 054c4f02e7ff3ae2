//! Assigned tasks: a given fruit to hold, or a point to push the hand to, in place of a harvest.

mod config;

pub use config::{ComplianceConfig, GOAL_TOML, GoalConfig, PushConfig};

use crate::config::PickerConfig;
use crate::plan::Target;
use orchard_perception::Track;
use orchard_quantity::Quantity;

/// Task of a picker in place of a harvest.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AssignedTask {
    /// Fruit or point, odom.
    pub target: Target,
    /// Push of the hand to the point; `None` for a fruit, which is grasped.
    pub push: Option<PushTask>,
}

/// Push of the hand to a point.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PushTask {
    /// Horizontal direction from the base to the point, from the x axis of odom \[rad\].
    pub heading_odom: f64,
    pub rules: PushConfig,
    /// Config of a compliant push; `None` for a push straight ahead.
    pub compliance: Option<ComplianceConfig>,
}

/// Number of the track that represents the target; the tracker counts from 0 and never reaches it.
const TRACK: u32 = u32::MAX;

impl AssignedTask {
    /// Returns a track at the target, as if the fruit had been seen.
    pub fn track(&self, time: f64) -> Track {
        let Target { p, radius } = self.target;
        Track { id: TRACK, p_odom: p, radius, score: 1.0, hits: u32::MAX, last_seen: time, confirmed: true }
    }

    /// Returns a picker's config with the changes that the task needs.
    pub fn adapted(&self, mut config: PickerConfig) -> PickerConfig {
        let Some(push) = &self.push else { return config };
        // Same plan as for a fruit, with a longer straight stretch that ends at the point.
        let approach = &mut config.approach;
        approach.look = push.rules.length.clone();
        let level_first = approach.elevations.first().and_then(level);
        approach.elevations.splice(0..0, level_first);
        let side = push.rules.side.si();
        config.align.bearings.retain(|bearing| bearing.si().abs() <= side);
        if push.compliance.is_none() {
            // As nearly horizontal and straight ahead as the arm can; points in the path do not count.
            approach.azimuths.retain(|azimuth| azimuth.si() == 0.0);
            config.align.bearings.retain(|bearing| bearing.si() == 0.0);
            for half in [&mut approach.sweep_half_x, &mut approach.sweep_half_y] {
                if let Some(none) = level(half) {
                    *half = none;
                }
            }
        }
        if let Some(none) = level(&approach.overshoot) {
            approach.overshoot = none;
        }
        config.grasp.opening = push.rules.opening.clone();
        config
    }
}

/// Returns the quantity with value 0, if its range allows it.
fn level(quantity: &Quantity) -> Option<Quantity> {
    quantity.with_value(0.0).ok()
}
