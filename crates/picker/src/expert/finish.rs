//! End of a run: the expert picks nothing that it can no longer bring to the bucket.

use crate::expert::{ExpertPicker, Phase};
use crate::record::FailureReason;
use crate::robot_state::RobotState;
use orchard_quantity::Quantity;

impl ExpertPicker {
    /// True if less than `least` is left of the run. An assigned task has its own end.
    fn has_less_than(&self, least: &Quantity, robot: &RobotState) -> bool {
        self.core.task.is_none() && self.run_end - robot.time < least.si()
    }

    /// True if the run ends before another attempt would.
    pub(crate) fn is_too_late(&self, robot: &RobotState) -> bool {
        self.has_less_than(&self.config.finish.attempt, robot)
    }

    /// Returns why an attempt that has not come to its fruit cannot go on at the end of the run.
    pub(crate) fn cut_off(&self, phase: &Phase, robot: &RobotState) -> Option<FailureReason> {
        let approaches = matches!(phase, Phase::Align(_) | Phase::Reach(_));
        (approaches && self.has_less_than(&self.config.finish.approach, robot))
            .then_some(FailureReason::RunEnded)
    }
}
