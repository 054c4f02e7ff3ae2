//! Align: drive to the stand-off, with the arm unfolding on the last stretch. Reach: look at the fruit from near by. If the hand meets wood
//! it goes back and approaches from another direction.

use crate::align::Drive;
use crate::cloud::SeenPoint;
use crate::drive::{BaseGoal, StallWatch};
use crate::expert::views::Views;
use crate::expert::{Caution, ExpertPicker, Next, Phase};
use crate::picker_core::STILL;
use crate::plan::{GraspPlan, Search, Target, swept};
use crate::record::FailureReason;
use crate::robot_state::RobotState;
use orchard_geometry::{Vec3, inverse_transform, math};

/// Memory of the align state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Align {
    goal: BaseGoal,
    stall: StallWatch,
    unfolding: bool,
}

impl Align {
    pub fn towards(goal: BaseGoal) -> Self {
        Self { goal, stall: StallWatch::default(), unfolding: false }
    }
}

/// Memory of the reach state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reach {
    views: Views,
    /// Number of failed tries at this target.
    failed: u32,
    /// True while the hand goes back from wood.
    recoiling: bool,
    /// True once the approach has been chosen again for the neighbours seen from near by.
    cleared: bool,
}

impl Reach {
    pub fn new(failed: u32) -> Self {
        Self { views: Views::new(), failed, recoiling: false, cleared: false }
    }

    fn recoiling(failed: u32) -> Self {
        Self { recoiling: true, ..Self::new(failed) }
    }
}

impl ExpertPicker {
    pub(crate) fn align(&mut self, mut align: Align, robot: &RobotState) -> Next {
        let carry = self.core.postures.carry();
        if self.core.motion.is_over() && !align.unfolding && *self.core.motion.q() != carry {
            self.swing_to(carry);
        }
        if align.unfolding && self.is_pressed() {
            return self.recoil(0, robot);
        }
        if self.is_stopped() {
            self.core.note_yielding(robot, self.force.norm());
            return Next::Fail(FailureReason::Blocked);
        }
        let blind = self.is_blind(robot);
        let Drive { velocity, stands } = match self.core.drive_to(&align.goal, &mut align.stall, blind, robot)
        {
            Ok(drive) => drive,
            Err(reason) => return Next::Fail(reason),
        };
        if blind {
            return Next::Stay(Phase::Align(align), STILL);
        }
        let folded = (self.core.motion.q() - carry).amax() <= self.config.unfold.folded.si();
        if !align.unfolding && folded && align.goal.distance(robot) <= self.config.unfold.base_left.si() {
            self.core.update_from_track();
            self.unfold(&align.goal, robot);
            align.unfolding = true;
        }
        if !(align.unfolding && stands) {
            return Next::Stay(Phase::Align(align), velocity);
        }
        if !self.adjust(robot) {
            return Next::Fail(FailureReason::Unreachable);
        }
        Next::Enter(Phase::Reach(Reach::new(0)))
    }

    /// Plans the approach again for the place where the base will stand, with the images since the commitment, and starts the arm towards
    /// the look posture.
    fn unfold(&mut self, goal: &BaseGoal, robot: &RobotState) {
        let there = goal.pose(robot.x_odom_base.translation.z);
        let Some(attempt) = &self.core.attempt else { return };
        let target =
            Target { p: inverse_transform(&there, &attempt.target.p), radius: attempt.target.radius };
        let points: Vec<SeenPoint> =
            self.core.perception.points().map(|point| point.within(&there)).collect();
        let others = self.core.others_than_target(&there);
        let refused = self.core.blacklist.refused(&attempt.target.p, &there);
        let plan = self.clearest_approach(&target, &points, &others, &refused, |_| true);
        if let (Some(plan), Some(attempt)) = (plan, &mut self.core.attempt) {
            attempt.plan = plan;
        }
        let Some(attempt) = &self.core.attempt else { return };
        let q_look = attempt.plan.q_look;
        self.swing_among(q_look, Caution::Normal);
    }

    /// Returns the approach of least cost among the allowed directions (base frame), including the points that the hand would meet on its
    /// swing to the look posture.
    fn clearest_approach(
        &self,
        target: &Target,
        points: &[SeenPoint],
        others: &[Target],
        refused: &[Vec3],
        is_allowed: impl Fn(&Vec3) -> bool,
    ) -> Option<GraspPlan> {
        let search = Search { refused, ..self.core.search(target, points, others) };
        let swing_cost = self.config.unfold.swing_cost.si();
        let mut approaches = search.approaches(is_allowed);
        for approach in &mut approaches {
            let met = swept(search.arm, points, [search.q_start, &approach.q_look], search.config);
            approach.cost += swing_cost * met;
        }
        approaches.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Corrects the look posture for the actual positions of base and fruit: in the same direction if the arm can follow it, else in
    /// another.
    fn adjust(&mut self, robot: &RobotState) -> bool {
        let near = self.core.attempt.as_ref().map_or(*self.core.motion.q(), |a| a.plan.q_look);
        match self.core.corrected_plan(robot, &near) {
            Some(plan) => self.look_from(plan, Caution::Normal),
            None => self.turn_elsewhere(robot, Caution::Normal, |_| true),
        }
    }

    /// Changes to the best approach among the allowed directions.
    fn turn_elsewhere(
        &mut self,
        robot: &RobotState,
        caution: Caution,
        is_allowed: impl Fn(&Vec3) -> bool,
    ) -> bool {
        let Some(target) = self.core.target_base(robot) else { return false };
        let points = self.core.points_base(robot);
        let others = self.core.others_than_target(&robot.x_odom_base);
        let refused = self.refused(robot);
        self.clearest_approach(&target, &points, &others, &refused, is_allowed)
            .is_some_and(|plan| self.look_from(plan, caution))
    }

    /// Directions from which something stopped the hand at the target, base frame.
    fn refused(&self, robot: &RobotState) -> Vec<Vec3> {
        let p_odom = self.core.attempt.as_ref().map(|attempt| attempt.target.p);
        p_odom.map_or(Vec::new(), |p_odom| self.core.blacklist.refused(&p_odom, &robot.x_odom_base))
    }

    /// Changes to another direction than the one in which wood stopped the hand or leaves hid the fruit.
    fn turn_away(&mut self, robot: &RobotState) -> bool {
        let Some(refused) = self.core.attempt.as_ref().map(|a| a.plan.direction()) else { return false };
        let least = math::cos(self.config.homing.other_angle.si());
        self.turn_elsewhere(robot, Caution::High, |direction| direction.dot(&refused) <= least)
    }

    /// Starts the arm to the look posture of a plan.
    fn look_from(&mut self, plan: GraspPlan, caution: Caution) -> bool {
        let Some(attempt) = &mut self.core.attempt else { return false };
        let q_look = plan.q_look;
        attempt.plan = plan;
        self.swing_among(q_look, caution);
        true
    }

    /// Goes back to the carrying posture after the hand has met wood, to approach from another direction if a try is left.
    fn recoil(&mut self, failed: u32, robot: &RobotState) -> Next {
        self.core.note_yielding(robot, self.force.norm());
        let failed = failed + 1;
        if failed >= self.config.homing.tries.get() {
            return Next::Fail(FailureReason::Blocked);
        }
        self.core.yield_arm(robot);
        self.swing_among(self.core.postures.carry(), Caution::High);
        Next::Enter(Phase::Reach(Reach::recoiling(failed)))
    }

    pub(crate) fn reach(&mut self, mut reach: Reach, robot: &RobotState) -> Next {
        if self.core.arm_stalled() || self.core.elapsed(robot) > self.core.config.timeout.reach.si() {
            return Next::Fail(FailureReason::ReachStalled);
        }
        if self.is_blind(robot) {
            // A leaf hangs before the lens, or the camera fails.
            return Next::Fail(FailureReason::NoSight);
        }
        if reach.recoiling {
            if !self.core.motion.is_over() {
                return Next::Stay(Phase::Reach(reach), STILL);
            }
            if !self.turn_away(robot) {
                return Next::Fail(FailureReason::Blocked);
            }
            reach.recoiling = false;
            self.core.restart_clock(robot);
        } else if self.is_pressed() {
            return self.recoil(reach.failed, robot);
        }
        self.view(&mut reach.views);
        let Some(attempt) = &self.core.attempt else {
            return Next::Fail(FailureReason::NoFruitAtDetection);
        };
        let left = (self.core.motion.q() - attempt.plan.q_look).amax();
        let c = &self.core.config.reach;
        let enough = reach.views.hits >= c.look_images.get();
        let ended = reach.views.images >= c.look_images_max.get();
        if left > self.config.unfold.near.si() || !(enough || ended) {
            return Next::Stay(Phase::Reach(reach), STILL);
        }
        if reach.views.hits == 0 && attempt.hits < c.trusted_hits.get() {
            // Leaves may hide the fruit from here.
            let failed = reach.failed + 1;
            if failed < self.config.homing.tries.get() && self.turn_away(robot) {
                return Next::Enter(Phase::Reach(Reach::new(failed)));
            }
            return Next::Fail(FailureReason::NoFruitAtDetection);
        }
        if !reach.cleared && self.clear_of_neighbours(robot) {
            reach.cleared = true;
            return Next::Stay(Phase::Reach(reach), STILL);
        }
        if self.is_hemmed_in(robot) {
            return Next::Fail(FailureReason::HemmedIn);
        }
        self.home_in(reach.views, reach.failed, robot)
    }

    /// True if the open fingers would touch other fruit, and those have not had their turn yet. An assigned target is tried in any case.
    fn is_hemmed_in(&self, robot: &RobotState) -> bool {
        let (Some(target), Some(attempt)) = (self.core.target_base(robot), &self.core.attempt) else {
            return false;
        };
        if self.core.task.is_some() || self.core.blacklist.has_waited(&attempt.target.p, robot.time) {
            return false;
        }
        let others = self.core.others_than_target(&robot.x_odom_base);
        self.core.search(&target, &[], &others).brushed(&attempt.plan.rotation) > 0
    }

    /// Changes to an approach on which the open fingers touch fewer of the fruit seen from near by, if there is one. Returns true if it did.
    fn clear_of_neighbours(&mut self, robot: &RobotState) -> bool {
        let (Some(target), Some(attempt)) = (self.core.target_base(robot), &self.core.attempt) else {
            return false;
        };
        let others = self.core.others_than_target(&robot.x_odom_base);
        let search = self.core.search(&target, &[], &others);
        let brushed = search.brushed(&attempt.plan.rotation);
        if brushed == 0 {
            return false;
        }
        let points = self.core.points_base(robot);
        let direction = attempt.plan.direction();
        let least = math::cos(self.config.homing.clear_angle.si());
        let refused = self.refused(robot);
        let is_near = |d: &Vec3| d.dot(&direction) >= least;
        let plan = self.clearest_approach(&target, &points, &others, &refused, is_near);
        match plan.filter(|plan| search.brushed(&plan.rotation) < brushed) {
            Some(plan) => self.look_from(plan, Caution::Normal),
            None => false,
        }
    }

    /// Looks at the target again, from where the hand has backed out after a failed try; from another direction if something stopped the
    /// hand.
    pub(crate) fn look_again(&mut self, refused: bool, failed: u32, robot: &RobotState) -> Next {
        let q = *self.core.motion.q();
        if let Some(attempt) = &mut self.core.attempt {
            attempt.plan.q_look = q;
            // Only new images count, except for an assigned target.
            attempt.hits = if self.core.task.is_some() { attempt.hits } else { 0 };
        }
        if refused && !self.turn_away(robot) {
            return Next::Fail(FailureReason::GraspStalled);
        }
        Next::Enter(Phase::Reach(Reach::new(failed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;
    use orchard_geometry::transform;
    use orchard_perception::{DetectorConfig, Sighting};
    use orchard_robot::RobotModel;

    /// Fruit seen beside the target from near by turn the hand, though they were seen once; without them it stays as it is.
    #[test]
    fn neighbours_seen_from_near_by_turn_the_hand() {
        let model = RobotModel::paper();
        let p_target = Vec3::new(0.7, 0.0, 0.9);
        for beside in [false, true] {
            let mut picker = ExpertPicker::new(&model, DetectorConfig::paper(), ExpertConfig::preset());
            let robot = RobotState { q: *picker.core.motion.q(), ..RobotState::still(1.0) };
            let target = Target { p: transform(&robot.x_odom_base, &p_target), radius: 0.03 };
            let plan = picker.clearest_approach(&Target { p: p_target, ..target }, &[], &[], &[], |_| true);
            picker.core.commit(&robot, u32::MAX, target, plan.expect("within reach"));
            if beside {
                let at = |y: f64| transform(&robot.x_odom_base, &(p_target + Vec3::y() * y));
                let sightings = [0.07, -0.07].map(|y| Sighting { p_odom: at(y), radius: 0.03, score: 1.0 });
                picker.core.perception.tracker.update(1.0, &sightings);
            }
            let before = picker.core.attempt.clone().expect("committed").plan;
            assert_eq!(picker.clear_of_neighbours(&robot), beside);
            let after = picker.core.attempt.clone().expect("committed").plan;
            assert_eq!(after != before, beside);
            assert!(!picker.clear_of_neighbours(&robot), "nothing is left to clear");
        }
    }

    /// A press on the folded arm ends a drive; one as bumps under the wheels cause it does not. An arm that unfolds goes back from the smaller one already.
    #[test]
    fn a_press_on_the_folded_arm_ends_the_drive() {
        let model = RobotModel::paper();
        for (share, unfolding, ends) in [(0.9, false, false), (1.1, false, true), (0.9, true, true)] {
            let mut picker = ExpertPicker::new(&model, DetectorConfig::paper(), ExpertConfig::preset());
            picker.core.perception.blind = false;
            let robot = RobotState { q: picker.core.postures.carry(), ..RobotState::still(1.0) };
            picker.force = Vec3::x() * (share * picker.config.feel.drive_max.si());
            assert!(picker.is_pressed());
            let goal = BaseGoal { x: 1.0, y: 0.0, yaw: 0.0 };
            let next = picker.align(Align { unfolding, ..Align::towards(goal) }, &robot);
            match next {
                Next::Fail(reason) => assert!(ends && !unfolding && reason == FailureReason::Blocked),
                Next::Enter(Phase::Reach(reach)) => assert!(unfolding && reach.recoiling),
                _ => assert!(!ends, "{share} {unfolding}"),
            }
        }
    }
}
