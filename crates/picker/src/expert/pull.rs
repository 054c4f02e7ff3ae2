//! Pull: withdraw until the stem breaks, or until wood yields.

use crate::expert::place::Deposit;
use crate::expert::{ExpertPicker, Next, Phase};
use crate::picker_core::STILL;
use crate::record::FailureReason;
use crate::robot_state::RobotState;

/// Memory of the pull state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pull {
    /// Smoothed pull along the withdrawal \[N\] and its largest value.
    tension: f64,
    peak: f64,
    travelled: f64,
    /// Smoothed weight on the hand \[N\].
    weight: f64,
    /// Time for which the pull has been well below its peak, but not slack \[s\].
    sagging: f64,
    /// Time since the withdrawal ended \[s\]; the smoothed pull lags behind a stem that breaks at the end.
    settled: f64,
    /// Number of failed tries at this target.
    failed: u32,
}

impl Pull {
    fn new(failed: u32) -> Self {
        Self { tension: 0.0, peak: 0.0, travelled: 0.0, weight: 0.0, sagging: 0.0, settled: 0.0, failed }
    }
}

impl ExpertPicker {
    /// Starts the hand back along the approach with the fruit.
    pub(crate) fn start_pull(&mut self, failed: u32) -> Next {
        let Some(attempt) = &self.core.attempt else { return Next::Fail(FailureReason::Slipped) };
        let c = &self.core.config;
        let (distance, speed) = (c.pull.distance.si(), c.arm.withdraw_speed.si());
        self.core.motion.go_straight(&self.core.arm, -attempt.plan.direction(), distance, speed, &c.arm);
        Next::Enter(Phase::Pull(Pull::new(failed)))
    }

    pub(crate) fn pull(&mut self, mut pull: Pull, robot: &RobotState) -> Next {
        if !self.still_holds(robot) {
            return self.grasp_again(pull.failed, robot);
        }
        let Some(direction) = self.core.attempt.as_ref().map(|a| a.plan.direction()) else {
            return Next::Fail(FailureReason::Slipped);
        };
        let (c, feel) = (&self.core.config.pull, &self.config.feel);
        let force = self.core.tcp_force(robot);
        let weight = c.tension_weight.si();
        pull.tension += (-force.dot(&direction) - pull.tension) * weight;
        pull.weight += (force.z - pull.weight) * weight;
        pull.peak = pull.peak.max(pull.tension);
        pull.travelled = self.core.motion.travelled().unwrap_or(pull.travelled);
        let slack = pull.tension < c.tension_low.si();
        let was_taut = pull.peak > c.tension_high.si();
        let sags = was_taut && !slack && pull.tension < feel.wood_share.si() * pull.peak;
        pull.sagging = if sags { pull.sagging + robot.dt } else { 0.0 };
        let ended = self.core.motion.is_over() && (self.core.arm_arrived(robot) || self.core.arm_stalled())
            || self.core.elapsed(robot) > self.core.config.timeout.pull.si();
        // If the stem was never taut, only the weight tells a fruit from a leaf or nothing.
        if slack && (was_taut || (ended && pull.weight >= feel.weight_min.si())) {
            self.core.note_release_of_stem(robot, pull.peak);
            self.core.motion.set_line_speed(self.config.leave.speed.si());
            return Next::Enter(Phase::Deposit(Deposit::leaving(robot, pull.travelled)));
        }
        if ended && slack {
            return self.grasp_again(pull.failed, robot);
        }
        // Wood yields if the hand travels far with the stem taut, or if the pull falls and does not end.
        let wood_yields = pull.travelled > feel.wood_distance.si() || pull.sagging > feel.wood_time.si();
        if ended || (wood_yields && !slack) {
            if self.core.motion.travelled().is_some() {
                self.core.motion.stop();
            }
            pull.settled += robot.dt;
            if pull.settled > feel.settle_time.si() {
                return Next::Fail(FailureReason::StemTooStrong);
            }
        }
        Next::Stay(Phase::Pull(pull), STILL)
    }
}
