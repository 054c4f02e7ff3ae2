//! Grasp: advance without images and close the fingers. Pull: withdraw until the stem breaks.

use crate::baseline::deposit::Deposit;
use crate::baseline::{BaselinePicker, Next, Phase};
use crate::picker_core::STILL;
use crate::plan::advance_length;
use crate::record::FailureReason;
use crate::robot_state::RobotState;
use orchard_geometry::Vec3;

/// Memory of the grasp state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Grasp {
    /// Correcting the hand's pose before the straight advance.
    Aiming,
    /// On the straight line to the fruit; `p_goal`: goal of the TCP in the base frame \[m\].
    Advancing { p_goal: Vec3 },
    /// Fingers closing since a time \[s\].
    Closing { since: f64, width: f64, steady: f64 },
    /// Holding before the pull since a time \[s\].
    Settling { since: f64 },
}

/// Memory of the pull state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pull {
    /// Smoothed pull along the withdrawal \[N\] and its largest value.
    tension: f64,
    peak: f64,
    travelled: f64,
}

impl BaselinePicker {
    pub(crate) fn grasp(&mut self, grasp: Grasp, robot: &RobotState) -> Next {
        let holding = self.core.task.is_some() && matches!(grasp, Grasp::Settling { .. });
        if self.core.elapsed(robot) > self.core.config.timeout.grasp.si() && !holding {
            return Next::Fail(FailureReason::GraspStalled);
        }
        let Some(direction) = self.core.attempt.as_ref().map(|a| a.plan.direction()) else {
            return Next::Fail(FailureReason::GraspStalled);
        };
        let stay = |grasp| Next::Stay(Phase::Grasp(grasp), STILL);
        match grasp {
            Grasp::Aiming if self.core.arm_stalled() => Next::Fail(FailureReason::GraspStalled),
            Grasp::Aiming if !self.core.arm_arrived(robot) => stay(grasp),
            Grasp::Aiming => {
                let radius = self.core.attempt.as_ref().map_or(0.0, |a| a.target.radius);
                let length = advance_length(&self.core.arm, radius, &self.core.config);
                let p_goal = self.core.arm.tcp(self.core.motion.q()).translation.vector + direction * length;
                let speed = self.core.config.arm.approach_speed.si();
                self.core.motion.go_straight(&self.core.arm, direction, length, speed, &self.core.config.arm);
                stay(Grasp::Advancing { p_goal })
            }
            Grasp::Advancing { p_goal } => self.advance(robot, &p_goal),
            Grasp::Closing { since, width, steady } => {
                let c = &self.core.config.grasp;
                let is_steady = (robot.width - width).abs() <= c.steady_width.si();
                let steady = if is_steady { steady + robot.dt } else { 0.0 };
                let closing_for = robot.time - since;
                let closed = self.core.has_closed(steady, c.steady_time.si(), robot);
                if !closed && closing_for < c.close_time.si() {
                    return stay(Grasp::Closing { since, width: robot.width, steady });
                }
                if !self.core.holds_fruit(robot) {
                    return Next::Fail(FailureReason::NoFruitAtDetection);
                }
                self.core.note_grasp(robot);
                stay(Grasp::Settling { since: robot.time })
            }
            Grasp::Settling { since } => {
                if robot.time - since < self.core.config.grasp.settle.si() {
                    return stay(grasp);
                }
                if !self.core.holds_fruit(robot) {
                    return Next::Fail(FailureReason::Slipped);
                }
                if self.core.task.is_some() {
                    return stay(grasp);
                }
                let (length, speed) =
                    (self.core.config.pull.distance.si(), self.core.config.arm.withdraw_speed.si());
                self.core.motion.go_straight(
                    &self.core.arm,
                    -direction,
                    length,
                    speed,
                    &self.core.config.arm,
                );
                Next::Enter(Phase::Pull(Pull { tension: 0.0, peak: 0.0, travelled: 0.0 }))
            }
        }
    }

    fn advance(&mut self, robot: &RobotState, p_goal: &Vec3) -> Next {
        let left = (self.core.arm.tcp(&robot.q).translation.vector - p_goal).norm();
        let near = left <= self.core.config.grasp.close_near.si();
        if self.core.motion.is_lost() && !near {
            return Next::Fail(FailureReason::GraspUnreachable);
        }
        if self.core.arm_stalled() && !near {
            return Next::Fail(FailureReason::GraspStalled);
        }
        if self.core.touches_down(left) {
            self.core.close_hand();
            self.core.motion.set_line_speed(self.core.config.suction.touch_speed.si());
        }
        let there = self.core.is_sealed(robot)
            || self.core.arm_arrived(robot)
            || (near && (self.core.arm_stalled() || self.core.motion.is_lost()));
        if !there {
            return Next::Stay(Phase::Grasp(Grasp::Advancing { p_goal: *p_goal }), STILL);
        }
        self.core.motion.stop();
        self.core.close_hand();
        let closing = Grasp::Closing { since: robot.time, width: f64::INFINITY, steady: 0.0 };
        Next::Stay(Phase::Grasp(closing), STILL)
    }

    pub(crate) fn pull(&mut self, mut pull: Pull, robot: &RobotState) -> Next {
        if !self.core.holds_fruit(robot) {
            return Next::Fail(FailureReason::Slipped);
        }
        let Some(direction) = self.core.attempt.as_ref().map(|a| a.plan.direction()) else {
            return Next::Fail(FailureReason::Slipped);
        };
        let c = &self.core.config.pull;
        let force = -self.core.tcp_force(robot).dot(&direction);
        pull.tension += (force - pull.tension) * c.tension_weight.si();
        pull.peak = pull.peak.max(pull.tension);
        pull.travelled = self.core.motion.travelled().unwrap_or(pull.travelled);
        let slack = pull.tension < c.tension_low.si();
        let gave_way = pull.peak > c.tension_high.si() && slack && pull.travelled >= c.clear_distance.si();
        let ended = self.core.motion.is_over() && (self.core.arm_arrived(robot) || self.core.arm_stalled())
            || self.core.elapsed(robot) > self.core.config.timeout.pull.si();
        if gave_way || (ended && slack) {
            self.core.note_release_of_stem(robot, pull.peak);
            self.core.motion.go(self.core.postures.carry(), &self.core.config.arm, 1.0);
            return Next::Enter(Phase::Deposit(Deposit::Carrying));
        }
        if ended {
            return Next::Fail(FailureReason::StemTooStrong);
        }
        Next::Stay(Phase::Pull(pull), STILL)
    }
}
