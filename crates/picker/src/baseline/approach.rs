//! Align: drive to the stand-off. Reach: bring the hand before the fruit and look again.

use crate::align::Drive;
use crate::baseline::grasp::Grasp;
use crate::baseline::push::Push;
use crate::baseline::{BaselinePicker, Next, Phase};
use crate::drive::{BaseGoal, StallWatch};
use crate::plan::{Search, Target};
use crate::record::FailureReason;
use crate::rig::STILL;
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
    /// Images taken before the fruit.
    images: u32,
    /// Those that showed it, and the sums of its centre (odom) and radius.
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
        let carry = self.rig.postures.carry();
        if self.rig.motion.is_over() && *self.rig.motion.q() != carry {
            self.rig.motion.go(carry, &self.rig.config.arm, 1.0);
        }
        let blind = self.rig.eyes.blind;
        let Drive { velocity, stands } = match self.rig.drive_to(&align.goal, &mut align.stall, blind, robot)
        {
            Ok(drive) => drive,
            Err(reason) => return Next::Fail(reason),
        };
        if !(stands && (self.rig.arm_arrived(robot) || self.rig.arm_stalled())) {
            return Next::Stay(Phase::Align(align), velocity);
        }
        self.rig.update_from_track();
        let (Some(target), points) = (self.rig.target_base(robot), self.rig.points_base(robot)) else {
            return Next::Fail(FailureReason::Unreachable);
        };
        let search = Search { q_start: &carry, ..self.rig.search(&target, &points) };
        let Some(plan) = search.best() else {
            return Next::Fail(FailureReason::Unreachable);
        };
        self.rig.motion.go(plan.q_look, &self.rig.config.arm, 1.0);
        if let Some(attempt) = &mut self.rig.attempt {
            attempt.plan = plan;
        }
        if self.rig.errand.as_ref().is_some_and(|errand| errand.push.is_some()) {
            return Next::Enter(Phase::Push(Push::Entering));
        }
        Next::Enter(Phase::Reach(Reach::new()))
    }

    pub(crate) fn reach(&mut self, mut reach: Reach, robot: &RobotState) -> Next {
        if self.rig.arm_stalled() {
            return Next::Fail(FailureReason::ReachStalled);
        }
        if self.rig.elapsed(robot) > self.rig.config.timeout.reach.si() {
            return Next::Fail(FailureReason::ReachStalled);
        }
        if !self.rig.arm_arrived(robot) || !self.rig.fresh_image {
            return Next::Stay(Phase::Reach(reach), STILL);
        }
        self.look(&mut reach);
        let c = &self.rig.config.reach;
        let enough = reach.hits >= c.look_images.get();
        if !enough && reach.images < c.look_images_max.get() {
            return Next::Stay(Phase::Reach(reach), STILL);
        }
        let Some(attempt) = &mut self.rig.attempt else {
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
        let Some(attempt) = &self.rig.attempt else { return };
        let nearest = self
            .rig
            .eyes
            .sightings
            .iter()
            .map(|s| ((s.p_odom - attempt.target.p).norm(), s))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((distance, sighting)) = nearest
            && distance <= self.rig.match_distance()
        {
            reach.hits += 1;
            reach.sum += sighting.p_odom;
            reach.radius_sum += sighting.radius;
        }
    }

    /// Corrects the hand for what the second look showed: the same direction if it still works, else another.
    fn start_grasp(&mut self, robot: &RobotState) -> Next {
        let Some(target) = self.rig.target_base(robot) else {
            return Next::Fail(FailureReason::GraspUnreachable);
        };
        let points = self.rig.points_base(robot);
        let same = self.rig.corrected_plan(robot, self.rig.motion.q());
        let Some(chosen) = same.or_else(|| self.rig.search(&target, &points).best()) else {
            return Next::Fail(FailureReason::GraspUnreachable);
        };
        self.rig.motion.go(chosen.q_look, &self.rig.config.arm, 1.0);
        if let Some(attempt) = &mut self.rig.attempt {
            attempt.plan = chosen;
        }
        Next::Enter(Phase::Grasp(Grasp::Aiming))
    }
}
