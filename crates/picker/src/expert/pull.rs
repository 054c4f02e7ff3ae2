//! Pull: withdraw until the stem gives way, or until it is the wood that yields.

use crate::expert::place::Deposit;
use crate::expert::{ExpertPicker, Next, Phase};
use crate::record::FailureReason;
use crate::rig::STILL;
use crate::robot_state::RobotState;

/// Memory of the pull state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pull {
    /// Smoothed pull along the withdrawal [N] and its largest value.
    tension: f64,
    peak: f64,
    travelled: f64,
}

impl Pull {
    pub fn new() -> Self {
        Self { tension: 0.0, peak: 0.0, travelled: 0.0 }
    }
}

impl ExpertPicker {
    pub(super) fn pull(&mut self, mut pull: Pull, robot: &RobotState) -> Next {
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
        let gave_way = pull.peak > c.tension_high.si() && slack;
        let ended = self.rig.motion.is_over() && (self.rig.arm_arrived(robot) || self.rig.arm_stalled())
            || self.rig.elapsed(robot) > self.rig.config.timeout.pull.si();
        if gave_way || (ended && slack) {
            self.rig.note_release_of_stem(robot, pull.peak);
            self.rig.motion.set_line_speed(self.config.leave.speed.si());
            return Next::Enter(Phase::Deposit(Deposit::leaving(robot, pull.travelled)));
        }
        if ended || (pull.travelled > self.config.feel.wood_way.si() && !slack) {
            return Next::Fail(FailureReason::StemTooStrong);
        }
        Next::Stay(Phase::Pull(pull), STILL)
    }
}
