//! Errands: a named fruit to hold, or a point to push the hand to.

use crate::baseline::{BaselinePicker, Fingers, Next, Phase, STILL};
use crate::compliance::Compliance;
use crate::config::PickerConfig;
use crate::goal::{ComplianceConfig, PushConfig};
use crate::plan::Target;
use crate::record::FailureReason;
use crate::robot_state::RobotState;
use orchard_geometry::{Pose, Vec3};
use orchard_perception::{DetectorConfig, Track};
use orchard_quantity::Quantity;
use orchard_robot::{IkTarget, RobotModel};

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
}

/// Memory of the push.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Push {
    /// Bringing the hand before the straight way.
    Entering,
    /// Reading what the arm's torques tell of nothing since a time.
    Listening { since: f64, sum: Vec3, readings: u32 },
    /// Straight on.
    Advancing,
    /// On a compliant way from a pose of the TCP, base frame.
    Feeling { from: Pose, way: Compliance },
    /// There.
    Holding,
}

/// The same quantity at 0, where its range allows that.
fn level(quantity: &Quantity) -> Option<Quantity> {
    quantity.with_value(0.0).ok()
}

impl BaselinePicker {
    /// A picker that does one thing in place of a harvest.
    pub(crate) fn on_errand(
        robot: &RobotModel,
        detector: DetectorConfig,
        mut config: PickerConfig,
        errand: Errand,
    ) -> Self {
        if let Some(push) = &errand.push {
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
        }
        Self { errand: Some(errand), ..Self::new(robot, detector, config) }
    }

    pub(crate) fn push(&mut self, push: Push, robot: &RobotState) -> Next {
        let (Some(Shove { rules, compliance, .. }), Some(direction)) = (
            self.errand.as_ref().and_then(|errand| errand.push.clone()),
            self.attempt.as_ref().map(|attempt| attempt.plan.direction()),
        ) else {
            return Next::Fail(FailureReason::Unreachable);
        };
        let stay = |push| Next::Stay(Phase::Push(push), STILL);
        if push == Push::Holding {
            return stay(push);
        }
        if self.elapsed(robot) > rules.timeout.si() {
            return Next::Fail(FailureReason::GraspStalled);
        }
        self.fingers = Fingers { opening: rules.opening.si(), force: self.config.grasp.force.si() };
        match (push, compliance) {
            (Push::Entering, _) if self.arm_stalled() => Next::Fail(FailureReason::ReachStalled),
            (Push::Entering, _) if !self.arm_arrived(robot) => stay(Push::Entering),
            (Push::Entering, Some(_)) => {
                stay(Push::Listening { since: robot.time, sum: Vec3::zeros(), readings: 0 })
            }
            (Push::Listening { since, sum, readings }, Some(compliance)) => {
                let (sum, readings) = (sum + self.hand_force(robot), readings + 1);
                if robot.time - since < compliance.still.si() {
                    return stay(Push::Listening { since, sum, readings });
                }
                let (length, speed) = (rules.length.si(), rules.speed.si());
                let bias = sum / f64::from(readings);
                let way = Compliance::new(compliance, direction, length, speed, bias);
                stay(Push::Feeling { from: self.arm.tcp(self.motion.q()), way })
            }
            (Push::Feeling { from, way }, _) => self.feel(from, way, robot),
            (Push::Advancing, _) if self.motion.is_lost() => Next::Fail(FailureReason::GraspUnreachable),
            (Push::Advancing, _) if self.arm_arrived(robot) => stay(Push::Holding),
            (Push::Advancing, _) if self.arm_stalled() && self.motion.is_over() => {
                Next::Fail(FailureReason::GraspStalled)
            }
            (Push::Advancing, _) => stay(Push::Advancing),
            _ => {
                let (length, speed) = (rules.length.si(), rules.speed.si());
                self.motion.go_straight(&self.arm, direction, length, speed, &self.config.arm);
                stay(Push::Advancing)
            }
        }
    }

    /// One frame of a compliant way.
    fn feel(&mut self, from: Pose, way: Compliance, robot: &RobotState) -> Next {
        let mut next = way.clone();
        next.advance(&self.hand_force(robot), robot.dt);
        let p = from.translation.vector + next.offset();
        let target = IkTarget::Pose(Pose::from_parts(p.into(), from.rotation));
        let q = self.arm.solve_near(&target, self.motion.q());
        match q {
            Ok(q) if (q - self.motion.q()).amax() <= self.config.arm.branch_jump.si() => {
                self.motion.place(q);
            }
            // Out of reach: another way around may do.
            _ => next.turn_back(),
        }
        if next.is_over() && self.arm_arrived(robot) {
            return Next::Stay(Phase::Push(Push::Holding), STILL);
        }
        Next::Stay(Phase::Push(Push::Feeling { from, way: next }), STILL)
    }

    /// Force that the hand exerts [N], base frame.
    fn hand_force(&self, robot: &RobotState) -> Vec3 {
        let gravity = Vec3::new(0.0, 0.0, -self.config.pull.gravity.si());
        self.arm.tcp_force(&robot.q, &robot.torque, &gravity)
    }
}
