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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Controller;
    use crate::expert::ExpertConfig;
    use crate::expert::approach::Align;
    use crate::scan::Scan;
    use orchard_perception::DetectorConfig;
    use orchard_robot::RobotModel;

    /// Near the end of a run no attempt begins, and one that has not come to its fruit ends; one that has goes on. A picker that knows no end has time.
    #[test]
    fn little_time_left_ends_approaches_and_begins_nothing() {
        let mut picker =
            ExpertPicker::new(&RobotModel::paper(), DetectorConfig::paper(), ExpertConfig::preset());
        let (attempt, approach) = (picker.config.finish.attempt.si(), picker.config.finish.approach.si());
        assert!(approach < attempt);
        let goal = crate::drive::BaseGoal { x: 0.0, y: 0.0, yaw: 0.0 };
        let align = Phase::Align(Align::towards(goal));
        let end = 60.0;
        let at = |left: f64| RobotState::still(end - left);
        assert!(!picker.is_too_late(&at(0.1)) && picker.cut_off(&align, &at(0.1)).is_none());
        picker.run_ends_at(end);
        assert!(!picker.is_too_late(&at(attempt + 0.1)) && picker.is_too_late(&at(attempt - 0.1)));
        assert!(picker.cut_off(&align, &at(approach + 0.1)).is_none());
        assert_eq!(picker.cut_off(&align, &at(approach - 0.1)), Some(FailureReason::RunEnded));
        assert!(picker.cut_off(&Phase::Scan(Scan::here()), &at(0.1)).is_none());
    }
}
