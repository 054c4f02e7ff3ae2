//! Push: the hand straight on to a place, or giving way on its way there.

use crate::baseline::{BaselinePicker, Next, Phase};
use crate::compliance::Compliance;
use crate::config::PickerConfig;
use crate::errand::{Errand, Shove};
use crate::record::FailureReason;
use crate::rig::{Fingers, STILL};
use crate::robot_state::RobotState;
use orchard_geometry::{Pose, Vec3};
use orchard_perception::DetectorConfig;
use orchard_robot::{IkTarget, RobotModel};

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
    Feeling { from: Pose, way: Box<Compliance> },
    /// There.
    Holding,
}

impl BaselinePicker {
    /// A picker that does one thing in place of a harvest.
    pub(crate) fn on_errand(
        robot: &RobotModel,
        detector: DetectorConfig,
        config: PickerConfig,
        errand: Errand,
    ) -> Self {
        let mut picker = Self::new(robot, detector, errand.shaped(config));
        picker.rig.errand = Some(errand);
        picker
    }

    pub(crate) fn push(&mut self, push: Push, robot: &RobotState) -> Next {
        let (Some(Shove { rules, compliance, .. }), Some(direction)) = (
            self.rig.errand.as_ref().and_then(|errand| errand.push.clone()),
            self.rig.attempt.as_ref().map(|attempt| attempt.plan.direction()),
        ) else {
            return Next::Fail(FailureReason::Unreachable);
        };
        let stay = |push| Next::Stay(Phase::Push(push), STILL);
        if push == Push::Holding {
            return stay(push);
        }
        if self.rig.elapsed(robot) > rules.timeout.si() {
            return Next::Fail(FailureReason::GraspStalled);
        }
        self.rig.fingers = Fingers { opening: rules.opening.si(), force: self.rig.config.grasp.force.si() };
        match (push, compliance) {
            (Push::Entering, _) if self.rig.arm_stalled() => Next::Fail(FailureReason::ReachStalled),
            (Push::Entering, _) if !self.rig.arm_arrived(robot) => stay(Push::Entering),
            (Push::Entering, Some(_)) => {
                stay(Push::Listening { since: robot.time, sum: Vec3::zeros(), readings: 0 })
            }
            (Push::Listening { since, sum, readings }, Some(compliance)) => {
                let (sum, readings) = (sum + self.rig.tcp_force(robot), readings + 1);
                if robot.time - since < compliance.still.si() {
                    return stay(Push::Listening { since, sum, readings });
                }
                let (length, speed) = (rules.length.si(), rules.speed.si());
                let bias = sum / f64::from(readings);
                let way = Box::new(Compliance::new(compliance, direction, length, speed, bias));
                stay(Push::Feeling { from: self.rig.arm.tcp(self.rig.motion.q()), way })
            }
            (Push::Feeling { from, way }, _) => self.feel(from, way, robot),
            (Push::Advancing, _) if self.rig.motion.is_lost() => Next::Fail(FailureReason::GraspUnreachable),
            (Push::Advancing, _) if self.rig.arm_arrived(robot) => stay(Push::Holding),
            (Push::Advancing, _) if self.rig.arm_stalled() && self.rig.motion.is_over() => {
                Next::Fail(FailureReason::GraspStalled)
            }
            (Push::Advancing, _) => stay(Push::Advancing),
            _ => {
                let (length, speed) = (rules.length.si(), rules.speed.si());
                self.rig.motion.go_straight(&self.rig.arm, direction, length, speed, &self.rig.config.arm);
                stay(Push::Advancing)
            }
        }
    }

    /// One frame of a compliant way.
    fn feel(&mut self, from: Pose, way: Box<Compliance>, robot: &RobotState) -> Next {
        let mut next = way.clone();
        next.advance(&self.rig.tcp_force(robot), robot.dt);
        let p = from.translation.vector + next.offset();
        let target = IkTarget::Pose(Pose::from_parts(p.into(), from.rotation));
        let q = self.rig.arm.solve_near(&target, self.rig.motion.q());
        match q {
            Ok(q) if (q - self.rig.motion.q()).amax() <= self.rig.config.arm.branch_jump.si() => {
                self.rig.motion.place(q);
            }
            // Out of reach: another way around may do.
            _ => next.turn_back(),
        }
        if next.is_over() && self.rig.arm_arrived(robot) {
            return Next::Stay(Phase::Push(Push::Holding), STILL);
        }
        Next::Stay(Phase::Push(Push::Feeling { from, way: next }), STILL)
    }
}
