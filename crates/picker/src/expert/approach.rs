//! Align: drive to the stand-off, the arm unfolding on the last stretch. Reach: look at the fruit from near by.

use crate::drive::{BaseGoal, StallWatch, Tolerance, drive};
use crate::expert::grasp::Grasp;
use crate::expert::{ExpertPicker, Next, Phase};
use crate::plan::{Target, look_posture, plan};
use crate::record::FailureReason;
use crate::rig::STILL;
use crate::robot_state::RobotState;
use orchard_geometry::{Vec3, inverse_transform, transform};

/// Memory of the align state.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Align {
    goal: BaseGoal,
    stall: StallWatch,
    unfolding: bool,
}

impl Align {
    pub fn towards(goal: BaseGoal) -> Self {
        Self { goal, stall: StallWatch::default(), unfolding: false }
    }
}

/// What has been seen of the target from near by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Views {
    /// Images that should show the target.
    images: u32,
    /// Those that did, and the sums of its centre (odom) and radius.
    hits: u32,
    sum: Vec3,
    radius_sum: f64,
}

impl Views {
    pub fn new() -> Self {
        Self { images: 0, hits: 0, sum: Vec3::zeros(), radius_sum: 0.0 }
    }

    /// The mean of all sightings.
    fn target(&self) -> Option<Target> {
        let hits = f64::from(self.hits);
        (self.hits > 0).then(|| Target { p: self.sum / hits, radius: self.radius_sum / hits })
    }
}

/// Memory of the reach state.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reach {
    views: Views,
    /// Tries at this target that came to nothing.
    failed: u32,
}

impl Reach {
    pub fn new(failed: u32) -> Self {
        Self { views: Views::new(), failed }
    }
}

impl ExpertPicker {
    pub(super) fn align(&mut self, mut align: Align, robot: &RobotState) -> Next {
        if self.rig.elapsed(robot) > self.rig.config.timeout.align.si() {
            return Next::Fail(FailureReason::AlignTimeout);
        }
        let carry = self.rig.postures.carry();
        if self.rig.motion.is_over() && !align.unfolding && *self.rig.motion.q() != carry {
            self.swing_to(carry);
        }
        if self.is_blind(robot) {
            return Next::Stay(Phase::Align(align), STILL);
        }
        let tree = self.rig.eyes.belief.p_odom();
        let c = &self.rig.config.align;
        let tolerance = Tolerance::new(&c.position_tolerance, &c.angle_tolerance);
        let (velocity, arrived) = drive(robot, &align.goal, &tree, &self.rig.config.drive, tolerance);
        if align.stall.is_stalled(robot, &velocity, &self.rig.config.drive, self.rig.patience()) {
            return Next::Fail(FailureReason::Blocked);
        }
        let folded = (self.rig.motion.q() - carry).amax() <= self.config.unfold.folded.si();
        if !align.unfolding && folded && align.goal.distance(robot) <= self.config.unfold.base_left.si() {
            self.rig.update_from_track();
            self.unfold(&align.goal, robot);
            align.unfolding = true;
        }
        let still = robot.base_speed <= self.rig.config.drive.stall_speed.si()
            && robot.turn_speed <= self.rig.config.drive.stall_speed.si();
        if !(align.unfolding && arrived && still) {
            return Next::Stay(Phase::Align(align), velocity);
        }
        if !self.adjust(robot) {
            return Next::Fail(FailureReason::Unreachable);
        }
        Next::Enter(Phase::Reach(Reach::new(0)))
    }

    /// Plans the approach anew for the place where the base is going to stand, with what has been seen since the
    /// commitment, and starts the arm towards its beginning.
    fn unfold(&mut self, goal: &BaseGoal, robot: &RobotState) {
        let there = goal.pose(robot.x_odom_base.translation.z);
        let Some(attempt) = &mut self.rig.attempt else { return };
        let target =
            Target { p: inverse_transform(&there, &attempt.target.p), radius: attempt.target.radius };
        let points: Vec<Vec3> = self.rig.eyes.points().map(|p| inverse_transform(&there, p)).collect();
        let carry = self.rig.postures.carry();
        if let Some(plan) = plan(&self.rig.arm, &target, &points, &carry, &self.rig.config) {
            attempt.plan = plan;
        }
        let q_look = attempt.plan.q_look;
        self.swing_to(q_look);
    }

    /// Corrects the posture of the second look for where base and fruit really are: the same direction if it still
    /// works, else another.
    pub(super) fn adjust(&mut self, robot: &RobotState) -> bool {
        let (Some(target), Some(attempt)) = (self.rig.target_base(robot), self.rig.attempt.clone()) else {
            return false;
        };
        let mut chosen = attempt.plan;
        match look_posture(&self.rig.arm, &target, &chosen.rotation, &chosen.q_look, &self.rig.config) {
            Some(q_look) => chosen.q_look = q_look,
            None => {
                let (points, q) = (self.rig.points_base(robot), *self.rig.motion.q());
                match plan(&self.rig.arm, &target, &points, &q, &self.rig.config) {
                    Some(other) => chosen = other,
                    None => return false,
                }
            }
        }
        self.swing_to(chosen.q_look);
        if let Some(attempt) = &mut self.rig.attempt {
            attempt.plan = chosen;
        }
        true
    }

    pub(super) fn reach(&mut self, mut reach: Reach, robot: &RobotState) -> Next {
        if self.rig.arm_stalled() || self.rig.elapsed(robot) > self.rig.config.timeout.reach.si() {
            return Next::Fail(FailureReason::ReachStalled);
        }
        self.view(&mut reach.views);
        let Some(attempt) = &self.rig.attempt else {
            return Next::Fail(FailureReason::NoFruitAtDetection);
        };
        let left = (self.rig.motion.q() - attempt.plan.q_look).amax();
        let c = &self.rig.config.reach;
        let enough = reach.views.hits >= c.look_images.get();
        let ended = reach.views.images >= c.look_images_max.get();
        if left > self.config.unfold.near.si() || !(enough || ended) {
            return Next::Stay(Phase::Reach(reach), STILL);
        }
        if reach.views.hits == 0 && attempt.hits < c.trusted_hits.get() {
            return Next::Fail(FailureReason::NoFruitAtDetection);
        }
        self.home_in(reach.views, reach.failed, robot)
    }

    /// Takes the frame's image as a view of the target from near by; whether it showed the target.
    pub(super) fn view(&mut self, views: &mut Views) -> bool {
        let farthest = self.rig.match_distance();
        let (Some(then), Some(attempt)) = (&self.rig.imaged, &mut self.rig.attempt) else { return false };
        let p_camera = transform(&then.x_odom_base, &self.rig.arm.camera(&then.q).translation.vector);
        if (p_camera - attempt.target.p).norm() > self.config.unfold.range.si() {
            return false;
        }
        views.images += 1;
        let off = |p: &Vec3| (p - attempt.target.p).norm();
        let nearest = self.rig.eyes.sightings.iter().min_by(|a, b| off(&a.p_odom).total_cmp(&off(&b.p_odom)));
        let Some(sighting) = nearest.filter(|s| off(&s.p_odom) <= farthest) else {
            return false;
        };
        views.hits += 1;
        views.sum += sighting.p_odom;
        views.radius_sum += sighting.radius;
        if let Some(target) = views.target() {
            attempt.target = target;
        }
        true
    }

    /// Starts the hand towards the fruit.
    fn home_in(&mut self, views: Views, failed: u32, robot: &RobotState) -> Next {
        self.rig.motion.stop();
        match self.steer(robot) {
            Some(()) => Next::Enter(Phase::Grasp(Grasp::homing(views, failed))),
            None => Next::Fail(FailureReason::GraspUnreachable),
        }
    }
}
