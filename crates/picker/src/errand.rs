//! Errands: a named fruit to hold, or a point to push the hand to, in place of a harvest.

use crate::config::PickerConfig;
use crate::goal::{ComplianceConfig, PushConfig};
use crate::plan::Target;
use orchard_perception::Track;
use orchard_quantity::Quantity;

/// What a picker is sent for in place of a harvest.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Errand {
    /// Where, odom.
    pub target: Target,
    /// How to push the hand there; `None` for a fruit, which is grasped.
    pub push: Option<Shove>,
}

/// How to push the hand to a place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shove {
    /// Level direction from the base to the place, from the x axis of odom [rad].
    pub heading_odom: f64,
    pub rules: PushConfig,
    /// How to give way; `None` for a level way straight on.
    pub compliance: Option<ComplianceConfig>,
}

/// Number of the track that stands for the target: the tracker counts from 0 and never comes so far.
const TRACK: u32 = u32::MAX;

impl Errand {
    /// The target as if it had been seen.
    pub fn track(&self, time: f64) -> Track {
        let Target { p, radius } = self.target;
        Track { id: TRACK, p_odom: p, radius, hits: u32::MAX, last_seen: time, confirmed: true }
    }

    /// A picker's config as the errand needs it.
    pub fn shaped(&self, mut config: PickerConfig) -> PickerConfig {
        let Some(push) = &self.push else { return config };
        // The same plan as for a fruit, with a longer straight way that ends at the point.
        let approach = &mut config.approach;
        approach.look = push.rules.length.clone();
        let level_first = approach.elevations.first().and_then(level);
        approach.elevations.splice(0..0, level_first);
        let side = push.rules.side.si();
        config.align.bearings.retain(|bearing| bearing.si().abs() <= side);
        if push.compliance.is_none() {
            // As near to level and straight ahead as the arm can, whatever is seen in the way.
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

/// The same quantity at 0, where its range allows that.
fn level(quantity: &Quantity) -> Option<Quantity> {
    quantity.with_value(0.0).ok()
}
