//! Align: drive to the stand-off. Reach: bring the hand in front of the fruit and look again.

use crate::align::Drive;
use crate::baseline::grasp::Grasp;
use crate::baseline::push::Push;
use crate::baseline::{BaselinePicker, Next, Phase};
use crate::drive::{BaseGoal, StallWatch};
use crate::picker_core::STILL;
use crate::plan::{Search, Target};
use crate::record::FailureReason;
use crate::robot_state::RobotState;
use orchard_geometry::Vec3;

/// Memory of the align state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Align {
    goal: BaseGoal,
    stall: StallWatch,
}

impl Align {
    pub fn towards(goal: BaseGoal) -> Self {
        Self { goal, stall: StallWatch::default() }
    }
}

/// Memory of the reach state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reach {
    /// Number of images taken from the look posture.
    images: u32,
    /// Number of those that showed the fruit, and the sums of its centre (odom) and radius \[m\].
    hits: u32,
    sum: Vec3,
    radius_sum: f64,
}

impl Reach {
    pub fn new() -> Self {
        Self { images: 0, hits: 0, sum: Vec3::zeros(), radius_sum: 0.0 }
    }
}

impl BaselinePicker {
    pub(crate) fn align(&mut self, mut align: Align, robot: &RobotState) -> Next {
        let carry = self.core.postures.carry();
        if self.core.motion.is_over() && *self.core.motion.q() != carry {
            self.core.motion.go(carry, &self.core.config.arm, 1.0);
        }
        let blind = self.core.perception.blind;
        let Drive { velocity, stands } = match self.core.drive_to(&align.goal, &mut align.stall, blind, robot)
        {
            Ok(drive) => drive,
            Err(reason) => return Next::Fail(reason),
        };
        if !(stands && (self.core.arm_arrived(robot) || self.core.arm_stalled())) {
            return Next::Stay(Phase::Align(align), velocity);
        }
        self.core.update_from_track();
        let (Some(target), points) = (self.core.target_base(robot), self.core.points_base(robot)) else {
            return Next::Fail(FailureReason::Unreachable);
        };
        let search = Search { q_start: &carry, ..self.core.search(&target, &points, &[]) };
        let Some(plan) = search.best() else {
            return Next::Fail(FailureReason::Unreachable);
        };
        self.core.motion.go(plan.q_look, &self.core.config.arm, 1.0);
        if let Some(attempt) = &mut self.core.attempt {
            attempt.plan = plan;
        }
        if self.core.task.as_ref().is_some_and(|task| task.push.is_some()) {
            return Next::Enter(Phase::Push(Push::Entering));
        }
        Next::Enter(Phase::Reach(Reach::new()))
    }

    pub(crate) fn reach(&mut self, mut reach: Reach, robot: &RobotState) -> Next {
        if self.core.arm_stalled() {
            return Next::Fail(FailureReason::ReachStalled);
        }
        if self.core.elapsed(robot) > self.core.config.timeout.reach.si() {
            return Next::Fail(FailureReason::ReachStalled);
        }
        if self.core.config.reach.look_images.get() == 0 && self.core.arm_arrived(robot) {
            return self.start_grasp(robot);
        }
        if !self.core.arm_arrived(robot) || !self.core.fresh_image {
            return Next::Stay(Phase::Reach(reach), STILL);
        }
        self.look(&mut reach);
        let c = &self.core.config.reach;
        let enough = reach.hits >= c.look_images.get();
        if !enough && reach.images < c.look_images_max.get() {
            return Next::Stay(Phase::Reach(reach), STILL);
        }
        let Some(attempt) = &mut self.core.attempt else {
            return Next::Fail(FailureReason::NoFruitAtDetection);
        };
        if reach.hits > 0 {
            let hits = f64::from(reach.hits);
            attempt.target = Target { p: reach.sum / hits, radius: reach.radius_sum / hits };
        } else if attempt.hits < c.trusted_hits.get() {
            return Next::Fail(FailureReason::NoFruitAtDetection);
        }
        self.start_grasp(robot)
    }

    fn look(&self, reach: &mut Reach) {
        reach.images += 1;
        let Some(attempt) = &self.core.attempt else { return };
        let nearest = self
            .core
            .perception
            .sightings
            .iter()
            .map(|s| ((s.p_odom - attempt.target.p).norm(), s))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((distance, sighting)) = nearest
            && distance <= self.core.match_distance()
        {
            reach.hits += 1;
            reach.sum += sighting.p_odom;
            reach.radius_sum += sighting.radius;
        }
    }

    /// Plans the straight advance to the updated target: in the same direction if the arm can follow it, else in another.
    fn start_grasp(&mut self, robot: &RobotState) -> Next {
        let Some(target) = self.core.target_base(robot) else {
            return Next::Fail(FailureReason::GraspUnreachable);
        };
        let points = self.core.points_base(robot);
        let same = self.core.corrected_plan(robot, self.core.motion.q());
        let Some(chosen) = same.or_else(|| self.core.search(&target, &points, &[]).best()) else {
            return Next::Fail(FailureReason::GraspUnreachable);
        };
        self.core.motion.go(chosen.q_look, &self.core.config.arm, 1.0);
        if let Some(attempt) = &mut self.core.attempt {
            attempt.plan = chosen;
        }
        Next::Enter(Phase::Grasp(Grasp::Aiming))
    }
}
