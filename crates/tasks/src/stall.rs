//! Stall detection: ends an episode if the robot has not moved for too long.

use orchard_geometry::math;
use orchard_robot::{JointValues, Observation};
use serde::{Deserialize, Serialize};

use crate::protocol::Rules;

/// Detects motion in the measured joints and base pose.
///
/// The reference is an observation, the anchor; the first observation that differs from it by more than a threshold becomes the
/// next anchor. A robot that stays within the thresholds for the stall time has stalled.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StallWatch {
    base: f64,
    angle: f64,
    limit: u32,
    anchor: Option<(JointValues, [f64; 3])>,
    still: u32,
}

impl StallWatch {
    /// Makes a detector with the protocol's rules, for frames of a given length \[s\].
    pub fn new(rules: &Rules, frame: f64) -> Self {
        Self {
            base: rules.stall_base.si(),
            angle: rules.stall_joint.si(),
            limit: (rules.stall_time.si() / frame).round() as u32,
            anchor: None,
            still: 0,
        }
    }

    /// Number of frames after which the robot may have stalled, at the earliest; at least 1.
    pub fn frames_left(&self) -> u32 {
        self.limit.saturating_sub(self.still).max(1)
    }

    /// Adds the observation of a frame; returns true once the robot has stalled.
    pub fn stalled(&mut self, observation: &Observation) -> bool {
        let (arm, base) = (observation.arm_q, observation.base_pose);
        let moved = self.anchor.is_none_or(|(arm0, base0)| {
            math::hypot(base[0] - base0[0], base[1] - base0[1]) > self.base
                || math::wrap_angle(base[2] - base0[2]).abs() > self.angle
                || arm.iter().zip(&arm0).any(|(q, q0)| (q - q0).abs() > self.angle)
        });
        if moved {
            self.anchor = Some((arm, base));
            self.still = 0;
        } else {
            self.still += 1;
        }
        self.still >= self.limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::observation;
    use crate::protocol::Protocol;

    #[test]
    fn only_lasting_stillness_is_a_stall() {
        // 15 s of frames of 1 s.
        let mut watch = StallWatch::new(&Protocol::paper().rules, 1.0);
        let mut seen = observation(0.0);
        for frame in 0..40 {
            // Vibration below the thresholds is no motion; a slow drift of the base is.
            seen.arm_q[2] = if frame % 2 == 0 { 0.009 } else { -0.009 };
            seen.base_pose[0] = 0.001 * f64::from(frame);
            assert!(!watch.stalled(&seen), "frame {frame}");
        }
        let still = (0..20).position(|_| watch.stalled(&seen)).unwrap();
        // Drift reset the anchor at most 11 frames before it ended.
        assert!((3..15).contains(&still), "{still}");
        let mut watch = StallWatch::new(&Protocol::paper().rules, 1.0);
        seen.base_pose[0] += 1.0;
        assert!(!watch.stalled(&seen));
        for left in (1..=15).rev() {
            assert_eq!(watch.frames_left(), left);
            assert_eq!(watch.stalled(&seen), left == 1);
        }
    }
}
