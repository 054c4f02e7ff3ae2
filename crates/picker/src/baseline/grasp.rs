//! Grasp: advance blind and close the fingers. Pull: withdraw until the stem gives way.

use crate::baseline::deposit::Deposit;
use crate::baseline::{BaselinePicker, Next, Phase};
use crate::plan::advance_length;
use crate::record::FailureReason;
use crate::rig::{Fingers, STILL};
use crate::robot_state::RobotState;
use orchard_geometry::Vec3;

/// Memory of the grasp state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Grasp {
    /// Correcting the hand before the straight advance.
    Aiming,
    /// On the straight line to the fruit; the goal of the TCP in the base frame.
    Advancing { p_goal: Vec3 },
    /// Closing since a time.
    Closing { since: f64, width: f64, steady: f64 },
    /// Holding before the pull, since a time.
    Settling { since: f64 },
}

/// Memory of the pull state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pull {
    /// Smoothed pull along the withdrawal [N] and its largest value.
    tension: f64,
    peak: f64,
    travelled: f64,
}

impl BaselinePicker {
    pub(crate) fn grasp(&mut self, grasp: Grasp, robot: &RobotState) -> Next {
        let holding = self.rig.errand.is_some() && matches!(grasp, Grasp::Settling { .. });
        if self.rig.elapsed(robot) > self.rig.config.timeout.grasp.si() && !holding {
            return Next::Fail(FailureReason::GraspStalled);
        }
        let Some(direction) = self.rig.attempt.as_ref().map(|a| a.plan.direction()) else {
            return Next::Fail(FailureReason::GraspStalled);
        };
        let stay = |grasp| Next::Stay(Phase::Grasp(grasp), STILL);
        match grasp {
            Grasp::Aiming if self.rig.arm_stalled() => Next::Fail(FailureReason::GraspStalled),
            Grasp::Aiming if !self.rig.arm_arrived(robot) => stay(grasp),
            Grasp::Aiming => {
                let length = advance_length(&self.rig.config);
                let p_goal = self.rig.arm.tcp(self.rig.motion.q()).translation.vector + direction * length;
                let speed = self.rig.config.arm.approach_speed.si();
                self.rig.motion.go_straight(&self.rig.arm, direction, length, speed, &self.rig.config.arm);
                stay(Grasp::Advancing { p_goal })
            }
            Grasp::Advancing { p_goal } => self.advance(robot, &p_goal),
            Grasp::Closing { since, width, steady } => {
                let c = &self.rig.config.grasp;
                let is_steady = (robot.width - width).abs() <= c.steady_width.si();
                let steady = if is_steady { steady + robot.dt } else { 0.0 };
                let closing_for = robot.time - since;
                if steady < c.steady_time.si() && closing_for < c.close_time.si() {
                    return stay(Grasp::Closing { since, width: robot.width, steady });
                }
                if !self.rig.holds_fruit(robot) {
                    return Next::Fail(FailureReason::NoFruitAtDetection);
                }
                self.rig.note_grasp(robot);
                stay(Grasp::Settling { since: robot.time })
            }
            Grasp::Settling { since } => {
                if robot.time - since < self.rig.config.grasp.settle.si() {
                    return stay(grasp);
                }
                if !self.rig.holds_fruit(robot) {
                    return Next::Fail(FailureReason::Slipped);
                }
                if self.rig.errand.is_some() {
                    return stay(grasp);
                }
                let (length, speed) =
                    (self.rig.config.pull.distance.si(), self.rig.config.arm.withdraw_speed.si());
                self.rig.motion.go_straight(&self.rig.arm, -direction, length, speed, &self.rig.config.arm);
                Next::Enter(Phase::Pull(Pull { tension: 0.0, peak: 0.0, travelled: 0.0 }))
            }
        }
    }

    fn advance(&mut self, robot: &RobotState, p_goal: &Vec3) -> Next {
        let left = (self.rig.arm.tcp(&robot.q).translation.vector - p_goal).norm();
        let near = left <= self.rig.config.grasp.close_near.si();
        if self.rig.motion.is_lost() && !near {
            return Next::Fail(FailureReason::GraspUnreachable);
        }
        if self.rig.arm_stalled() && !near {
            return Next::Fail(FailureReason::GraspStalled);
        }
        let there =
            self.rig.arm_arrived(robot) || (near && (self.rig.arm_stalled() || self.rig.motion.is_lost()));
        if !there {
            return Next::Stay(Phase::Grasp(Grasp::Advancing { p_goal: *p_goal }), STILL);
        }
        self.rig.motion.stop();
        self.rig.fingers = Fingers { opening: 0.0, force: self.rig.config.grasp.force.si() };
        let closing = Grasp::Closing { since: robot.time, width: f64::INFINITY, steady: 0.0 };
        Next::Stay(Phase::Grasp(closing), STILL)
    }

    pub(crate) fn pull(&mut self, mut pull: Pull, robot: &RobotState) -> Next {
        if !self.rig.holds_fruit(robot) {
            return Next::Fail(FailureReason::Slipped);
        }
        let Some(direction) = self.rig.attempt.as_ref().map(|a| a.plan.direction()) else {
            return Next::Fail(FailureReason::Slipped);
        };
        let c = &self.rig.config.pull;
        let force = -self.rig.tcp_force(robot).dot(&direction);
        pull.tension += (force - pull.tension) * c.tension_weight.si();
        pull.peak = pull.peak.max(pull.tension);
        pull.travelled = self.rig.motion.travelled().unwrap_or(pull.travelled);
        let slack = pull.tension < c.tension_low.si();
        let gave_way = pull.peak > c.tension_high.si() && slack && pull.travelled >= c.clear_distance.si();
        let ended = self.rig.motion.is_over() && (self.rig.arm_arrived(robot) || self.rig.arm_stalled())
            || self.rig.elapsed(robot) > self.rig.config.timeout.pull.si();
        if gave_way || (ended && slack) {
            self.rig.note_release_of_stem(robot, pull.peak);
            self.rig.motion.go(self.rig.postures.carry(), &self.rig.config.arm, 1.0);
            return Next::Enter(Phase::Deposit(Deposit::Carrying));
        }
        if ended {
            return Next::Fail(FailureReason::StemTooStrong);
        }
        Next::Stay(Phase::Pull(pull), STILL)
    }
}
