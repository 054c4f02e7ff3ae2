//! Grasp: advance blind and close the fingers. Pull: withdraw until the stem gives way.

use crate::baseline::deposit::Deposit;
use crate::baseline::{BaselinePicker, Fingers, Next, Phase, STILL};
use crate::plan::advance_length;
use crate::record::FailureReason;
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
        let holding = self.errand.is_some() && matches!(grasp, Grasp::Settling { .. });
        if self.elapsed(robot) > self.config.timeout.grasp.si() && !holding {
            return Next::Fail(FailureReason::GraspStalled);
        }
        let Some(direction) = self.attempt.as_ref().map(|a| a.plan.direction()) else {
            return Next::Fail(FailureReason::GraspStalled);
        };
        let stay = |grasp| Next::Stay(Phase::Grasp(grasp), STILL);
        match grasp {
            Grasp::Aiming if self.arm_stalled() => Next::Fail(FailureReason::GraspStalled),
            Grasp::Aiming if !self.arm_arrived(robot) => stay(grasp),
            Grasp::Aiming => {
                let length = advance_length(&self.config);
                let p_goal = self.arm.tcp(self.motion.q()).translation.vector + direction * length;
                let speed = self.config.arm.approach_speed.si();
                self.motion.go_straight(&self.arm, direction, length, speed, &self.config.arm);
                stay(Grasp::Advancing { p_goal })
            }
            Grasp::Advancing { p_goal } => self.advance(robot, &p_goal),
            Grasp::Closing { since, width, steady } => {
                let c = &self.config.grasp;
                let is_steady = (robot.width - width).abs() <= c.steady_width.si();
                let steady = if is_steady { steady + robot.dt } else { 0.0 };
                let closing_for = robot.time - since;
                if steady < c.steady_time.si() && closing_for < c.close_time.si() {
                    return stay(Grasp::Closing { since, width: robot.width, steady });
                }
                if !self.holds_fruit(robot) {
                    return Next::Fail(FailureReason::NoFruitAtDetection);
                }
                self.note_grasp(robot);
                stay(Grasp::Settling { since: robot.time })
            }
            Grasp::Settling { since } => {
                if robot.time - since < self.config.grasp.settle.si() {
                    return stay(grasp);
                }
                if !self.holds_fruit(robot) {
                    return Next::Fail(FailureReason::Slipped);
                }
                if self.errand.is_some() {
                    return stay(grasp);
                }
                let (length, speed) = (self.config.pull.distance.si(), self.config.arm.withdraw_speed.si());
                self.motion.go_straight(&self.arm, -direction, length, speed, &self.config.arm);
                Next::Enter(Phase::Pull(Pull { tension: 0.0, peak: 0.0, travelled: 0.0 }))
            }
        }
    }

    fn advance(&mut self, robot: &RobotState, p_goal: &Vec3) -> Next {
        let left = (self.arm.tcp(&robot.q).translation.vector - p_goal).norm();
        let near = left <= self.config.grasp.close_near.si();
        if self.motion.is_lost() && !near {
            return Next::Fail(FailureReason::GraspUnreachable);
        }
        if self.arm_stalled() && !near {
            return Next::Fail(FailureReason::GraspStalled);
        }
        let there = self.arm_arrived(robot) || (near && (self.arm_stalled() || self.motion.is_lost()));
        if !there {
            return Next::Stay(Phase::Grasp(Grasp::Advancing { p_goal: *p_goal }), STILL);
        }
        self.motion.stop();
        self.fingers = Fingers { opening: 0.0, force: self.config.grasp.force.si() };
        let closing = Grasp::Closing { since: robot.time, width: f64::INFINITY, steady: 0.0 };
        Next::Stay(Phase::Grasp(closing), STILL)
    }

    /// Whether the gap between the fingers is that of a fruit.
    pub(crate) fn holds_fruit(&self, robot: &RobotState) -> bool {
        robot.width >= self.config.grasp.fruit_width_min.si()
    }

    pub(crate) fn pull(&mut self, mut pull: Pull, robot: &RobotState) -> Next {
        if !self.holds_fruit(robot) {
            return Next::Fail(FailureReason::Slipped);
        }
        let Some(direction) = self.attempt.as_ref().map(|a| a.plan.direction()) else {
            return Next::Fail(FailureReason::Slipped);
        };
        let c = &self.config.pull;
        let gravity = Vec3::new(0.0, 0.0, -c.gravity.si());
        let force = -self.arm.tcp_force(&robot.q, &robot.torque, &gravity).dot(&direction);
        pull.tension += (force - pull.tension) * c.tension_weight.si();
        pull.peak = pull.peak.max(pull.tension);
        pull.travelled = self.motion.travelled().unwrap_or(pull.travelled);
        let slack = pull.tension < c.tension_low.si();
        let gave_way = pull.peak > c.tension_high.si() && slack && pull.travelled >= c.clear_distance.si();
        let ended = self.motion.is_over() && (self.arm_arrived(robot) || self.arm_stalled())
            || self.elapsed(robot) > self.config.timeout.pull.si();
        if gave_way || (ended && slack) {
            self.note_release_of_stem(robot, pull.peak);
            self.motion.go(self.postures.carry(), &self.config.arm, 1.0);
            return Next::Enter(Phase::Deposit(Deposit::Carrying));
        }
        if ended {
            return Next::Fail(FailureReason::StemTooStrong);
        }
        Next::Stay(Phase::Pull(pull), STILL)
    }
}
