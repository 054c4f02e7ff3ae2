//! Driving to the stand-off from which a fruit can be grasped.

use crate::drive::{BaseGoal, StallWatch, Tolerance};
use crate::picker_core::{PickerCore, STILL};
use crate::record::FailureReason;
use crate::robot_state::RobotState;

/// Result of one frame of driving to a stand-off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Drive {
    /// Velocity in the base frame [m/s, m/s, rad/s].
    pub velocity: [f64; 3],
    /// True if the base is at the stand-off and stands still.
    pub stands: bool,
}

impl PickerCore {
    /// Drives towards a stand-off; without sight the base waits.
    ///
    /// # Errors
    /// The drive takes too long, or something holds the base.
    pub fn drive_to(
        &mut self,
        goal: &BaseGoal,
        stall: &mut StallWatch,
        blind: bool,
        robot: &RobotState,
    ) -> Result<Drive, FailureReason> {
        if self.elapsed(robot) > self.config.timeout.align.si() {
            return Err(FailureReason::AlignTimeout);
        }
        if blind {
            return Ok(Drive { velocity: STILL, stands: false });
        }
        let (tree, c) = (self.perception.belief.p_odom(), &self.config.drive);
        let align = &self.config.align;
        let tolerance = Tolerance::new(&align.position_tolerance, &align.angle_tolerance);
        let (velocity, arrived) = self.mobility.towards(robot, goal, Some(&tree), c, tolerance);
        if stall.is_stalled(robot, &velocity, c, self.patience()) {
            self.meet_wall(robot);
            return Err(FailureReason::Blocked);
        }
        let still = robot.base_speed <= c.stall_speed.si() && robot.turn_speed <= c.stall_speed.si();
        Ok(Drive { velocity, stands: arrived && still })
    }
}
