//! Driving on to the next fruit while the arm puts the last one into the bucket.

use crate::drive::{BaseGoal, StallWatch, Tolerance};
use crate::expert::ExpertPicker;
use crate::picker_core::STILL;
use crate::record::Alarm;
use crate::robot_state::RobotState;
use orchard_geometry::transform;

/// The place to which the base drives meanwhile.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Onward {
    /// Track of the fruit.
    pub track: u32,
    goal: BaseGoal,
    stall: StallWatch,
    /// True once the base is there, or something holds it.
    over: bool,
}

impl ExpertPicker {
    /// Returns the place for the next fruit that it would try, if the base can drive there; the fruit in the hand does not count.
    pub(crate) fn onward(&self, robot: &RobotState) -> Option<Onward> {
        let (attempt, near) = (self.core.attempt.as_ref()?, self.core.match_distance());
        if !self.core.mobility.is_free() || self.is_blind(robot) {
            return None;
        }
        let p_hand = transform(&robot.x_odom_base, &self.core.arm.tcp(&robot.q).translation.vector);
        let choice = self.core.choose_among(robot, |track| {
            let away = [attempt.target.p, p_hand].iter().all(|p| (track.p_odom - p).norm() > near);
            track.id != attempt.track && away
        })?;
        Some(Onward { track: choice.track, goal: choice.goal, stall: StallWatch::default(), over: false })
    }

    /// Velocity of the base towards the place [m/s, m/s, rad/s]; it gives the place up where something holds it.
    pub(crate) fn drive_onward(&mut self, onward: &mut Option<Onward>, robot: &RobotState) -> [f64; 3] {
        let Some(Onward { goal, stall, over, .. }) = onward else { return STILL };
        // In the bucket the camera is too close to everything; the way is short and was seen.
        if *over || self.is_unsighted() || self.has(Alarm::ArmLoaded) {
            return STILL;
        }
        let (core, c) = (&self.core, &self.core.config);
        let tolerance = Tolerance::new(&c.align.position_tolerance, &c.align.angle_tolerance);
        let tree = core.perception.belief.p_odom();
        let (velocity, arrived) = core.mobility.towards(robot, goal, &tree, &c.drive, tolerance);
        let stalled = stall.is_stalled(robot, &velocity, &c.drive, core.patience());
        *over = arrived || stalled;
        let (goal, over) = (*goal, *over);
        if stalled {
            self.core.note_barrier(robot, &goal);
        }
        if over { STILL } else { velocity }
    }
}
