//! Push: the hand moves to a point, straight or compliantly.

use crate::baseline::{BaselinePicker, Next, Phase};
use crate::compliance::Compliance;
use crate::config::PickerConfig;
use crate::picker_core::STILL;
use crate::record::FailureReason;
use crate::robot_state::RobotState;
use crate::task::{AssignedTask, PushTask};
use orchard_geometry::{Pose, Vec3};
use orchard_perception::DetectorConfig;
use orchard_robot::{IkTarget, RobotModel};

/// Memory of the push.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Push {
    /// Bringing the hand to the start of the push.
    Entering,
    /// Measuring the force reading without contact since a time \[s\].
    Measuring { since: f64, sum: Vec3, readings: u32 },
    /// Moving straight ahead.
    Advancing,
    /// In a compliant push from a pose of the TCP, base frame.
    Complying { from: Pose, push: Box<Compliance> },
    /// At the point.
    Holding,
}

impl BaselinePicker {
    /// Makes a picker for an assigned task.
    pub(crate) fn with_task(
        robot: &RobotModel,
        detector: DetectorConfig,
        config: PickerConfig,
        task: AssignedTask,
    ) -> Self {
        let mut picker = Self::new(robot, detector, task.adapted(config));
        picker.core.task = Some(task);
        picker
    }

    pub(crate) fn push(&mut self, push: Push, robot: &RobotState) -> Next {
        let (Some(PushTask { rules, compliance, .. }), Some(direction)) = (
            self.core.task.as_ref().and_then(|task| task.push.clone()),
            self.core.attempt.as_ref().map(|attempt| attempt.plan.direction()),
        ) else {
            return Next::Fail(FailureReason::Unreachable);
        };
        let stay = |push| Next::Stay(Phase::Push(push), STILL);
        if push == Push::Holding {
            return stay(push);
        }
        if self.core.elapsed(robot) > rules.timeout.si() {
            return Next::Fail(FailureReason::GraspStalled);
        }
        self.core.open_by(rules.opening.si(), self.core.config.grasp.force.si());
        match (push, compliance) {
            (Push::Entering, _) if self.core.arm_stalled() => Next::Fail(FailureReason::ReachStalled),
            (Push::Entering, _) if !self.core.arm_arrived(robot) => stay(Push::Entering),
            (Push::Entering, Some(_)) => {
                stay(Push::Measuring { since: robot.time, sum: Vec3::zeros(), readings: 0 })
            }
            (Push::Measuring { since, sum, readings }, Some(compliance)) => {
                let (sum, readings) = (sum + self.core.tcp_force(robot), readings + 1);
                if robot.time - since < compliance.still.si() {
                    return stay(Push::Measuring { since, sum, readings });
                }
                let (length, speed) = (rules.length.si(), rules.speed.si());
                let bias = sum / f64::from(readings);
                let push = Box::new(Compliance::new(compliance, direction, length, speed, bias));
                stay(Push::Complying { from: self.core.arm.tcp(self.core.motion.q()), push })
            }
            (Push::Complying { from, push }, _) => self.comply(from, push, robot),
            (Push::Advancing, _) if self.core.motion.is_lost() => Next::Fail(FailureReason::GraspUnreachable),
            (Push::Advancing, _) if self.core.arm_arrived(robot) => stay(Push::Holding),
            (Push::Advancing, _) if self.core.arm_stalled() && self.core.motion.is_over() => {
                Next::Fail(FailureReason::GraspStalled)
            }
            (Push::Advancing, _) => stay(Push::Advancing),
            _ => {
                let (length, speed) = (rules.length.si(), rules.speed.si());
                self.core.motion.go_straight(&self.core.arm, direction, length, speed, &self.core.config.arm);
                stay(Push::Advancing)
            }
        }
    }

    /// Runs one frame of a compliant push.
    fn comply(&mut self, from: Pose, push: Box<Compliance>, robot: &RobotState) -> Next {
        let mut next = push.clone();
        next.advance(&self.core.tcp_force(robot), robot.dt);
        let p = from.translation.vector + next.offset();
        let target = IkTarget::Pose(Pose::from_parts(p.into(), from.rotation));
        let q = self.core.arm.solve_near(&target, self.core.motion.q());
        match q {
            Ok(q) if (q - self.core.motion.q()).amax() <= self.core.config.arm.branch_jump.si() => {
                self.core.motion.place(q);
            }
            // Out of reach: another detour may lead on.
            _ => next.turn_back(),
        }
        if next.is_over() && self.core.arm_arrived(robot) {
            return Next::Stay(Phase::Push(Push::Holding), STILL);
        }
        Next::Stay(Phase::Push(Push::Complying { from, push: next }), STILL)
    }
}
