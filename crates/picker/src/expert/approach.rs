//! Align: drive to the stand-off, the arm unfolding on the last stretch. Reach: look at the fruit from near by. Where the
//! hand meets wood on its way there it goes back and comes another way.

use crate::align::Drive;
use crate::drive::{BaseGoal, StallWatch};
use crate::expert::grasp::Grasp;
use crate::expert::{Care, ExpertPicker, Next, Phase};
use crate::plan::{GraspPlan, Target, swept};
use crate::record::FailureReason;
use crate::rig::STILL;
use crate::robot_state::RobotState;
use orchard_geometry::{Intrinsics, Vec3, inverse_transform, math};

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

/// What has been seen of the target from near by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Views {
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
pub(crate) struct Reach {
    views: Views,
    /// Tries at this target that came to nothing.
    failed: u32,
    /// On the way back from wood.
    recoiling: bool,
}

impl Reach {
    pub fn new(failed: u32) -> Self {
        Self { views: Views::new(), failed, recoiling: false }
    }

    fn recoiling(failed: u32) -> Self {
        Self { recoiling: true, ..Self::new(failed) }
    }
}

impl ExpertPicker {
    pub(crate) fn align(&mut self, mut align: Align, robot: &RobotState) -> Next {
        let carry = self.rig.postures.carry();
        if self.rig.motion.is_over() && !align.unfolding && *self.rig.motion.q() != carry {
            self.swing_to(carry);
        }
        if align.unfolding && self.is_pressed() {
            return self.recoil(0, robot);
        }
        let blind = self.is_blind(robot);
        let Drive { velocity, stands } = match self.rig.drive_to(&align.goal, &mut align.stall, blind, robot)
        {
            Ok(drive) => drive,
            Err(reason) => return Next::Fail(reason),
        };
        if blind {
            return Next::Stay(Phase::Align(align), STILL);
        }
        let folded = (self.rig.motion.q() - carry).amax() <= self.config.unfold.folded.si();
        if !align.unfolding && folded && align.goal.distance(robot) <= self.config.unfold.base_left.si() {
            self.rig.update_from_track();
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

    /// Plans the approach anew for the place where the base is going to stand, with what has been seen since the
    /// commitment, and starts the arm towards its beginning.
    fn unfold(&mut self, goal: &BaseGoal, robot: &RobotState) {
        let there = goal.pose(robot.x_odom_base.translation.z);
        let Some(attempt) = &mut self.rig.attempt else { return };
        let target =
            Target { p: inverse_transform(&there, &attempt.target.p), radius: attempt.target.radius };
        let points: Vec<Vec3> = self.rig.eyes.points().map(|p| inverse_transform(&there, p)).collect();
        let plan = self.clearest_way(&target, &points, |_| true);
        if let (Some(plan), Some(attempt)) = (plan, &mut self.rig.attempt) {
            attempt.plan = plan;
        }
        let Some(attempt) = &self.rig.attempt else { return };
        let q_look = attempt.plan.q_look;
        self.swing_among(q_look, Care::Usual);
    }

    /// Of the approaches that are allowed (directions in the base frame) the one with least in the way, also of the hand's
    /// swing to where it looks.
    fn clearest_way(
        &self,
        target: &Target,
        points: &[Vec3],
        is_allowed: impl Fn(&Vec3) -> bool,
    ) -> Option<GraspPlan> {
        let search = self.rig.search(target, points);
        let swing_cost = self.config.unfold.swing_cost.si();
        let mut ways = search.ways(is_allowed);
        for way in &mut ways {
            let met = swept(search.arm, points, [search.q_start, &way.q_look], search.config);
            way.cost += swing_cost * met as f64;
        }
        ways.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Corrects the posture of the second look for where base and fruit really are: the same direction if it still
    /// works, else another.
    fn adjust(&mut self, robot: &RobotState) -> bool {
        let near = self.rig.attempt.as_ref().map_or(*self.rig.motion.q(), |a| a.plan.q_look);
        match self.rig.corrected_plan(robot, &near) {
            Some(plan) => self.look_from(plan, Care::Usual),
            None => self.turn_elsewhere(robot, Care::Usual, |_| true),
        }
    }

    /// Goes over to another approach among those allowed.
    fn turn_elsewhere(&mut self, robot: &RobotState, care: Care, is_allowed: impl Fn(&Vec3) -> bool) -> bool {
        let Some(target) = self.rig.target_base(robot) else { return false };
        let points = self.rig.points_base(robot);
        self.clearest_way(&target, &points, is_allowed).is_some_and(|plan| self.look_from(plan, care))
    }

    /// Goes over to another approach than the one in which wood stopped the hand or leaves hid the fruit.
    pub(crate) fn turn_away(&mut self, robot: &RobotState) -> bool {
        let Some(refused) = self.rig.attempt.as_ref().map(|a| a.plan.direction()) else { return false };
        let least = math::cos(self.config.homing.other_angle.si());
        self.turn_elsewhere(robot, Care::Much, |direction| direction.dot(&refused) <= least)
    }

    /// Starts the arm to where an approach begins.
    fn look_from(&mut self, plan: GraspPlan, care: Care) -> bool {
        let Some(attempt) = &mut self.rig.attempt else { return false };
        let q_look = plan.q_look;
        attempt.plan = plan;
        self.swing_among(q_look, care);
        true
    }

    /// Back to the carrying posture from wood that the hand has met, to come another way if a try is left.
    fn recoil(&mut self, failed: u32, robot: &RobotState) -> Next {
        self.rig.note_yielding(robot, self.touch);
        let failed = failed + 1;
        if failed >= self.config.homing.tries.get() {
            return Next::Fail(FailureReason::Blocked);
        }
        self.rig.yield_arm(robot);
        self.swing_among(self.rig.postures.carry(), Care::Much);
        Next::Enter(Phase::Reach(Reach::recoiling(failed)))
    }

    pub(crate) fn reach(&mut self, mut reach: Reach, robot: &RobotState) -> Next {
        if self.rig.arm_stalled() || self.rig.elapsed(robot) > self.rig.config.timeout.reach.si() {
            return Next::Fail(FailureReason::ReachStalled);
        }
        if reach.recoiling {
            if !self.rig.motion.is_over() {
                return Next::Stay(Phase::Reach(reach), STILL);
            }
            if !self.turn_away(robot) {
                return Next::Fail(FailureReason::Blocked);
            }
            reach.recoiling = false;
            self.rig.restart_clock(robot);
        } else if self.is_pressed() {
            return self.recoil(reach.failed, robot);
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
            // Leaves may hide it from here.
            let failed = reach.failed + 1;
            if failed < self.config.homing.tries.get() && self.turn_away(robot) {
                return Next::Enter(Phase::Reach(Reach::new(failed)));
            }
            return Next::Fail(FailureReason::NoFruitAtDetection);
        }
        self.home_in(reach.views, reach.failed, robot)
    }

    /// Takes the frame's image as a view of the target from near by; whether it showed the target.
    pub(crate) fn view(&mut self, views: &mut Views) -> bool {
        let farthest = self.rig.match_distance();
        let (Some((then, camera)), Some(attempt)) = (&self.rig.imaged, &mut self.rig.attempt) else {
            return false;
        };
        let x_odom_camera = then.x_odom_base * self.rig.arm.camera(&then.q);
        let p_camera = inverse_transform(&x_odom_camera, &attempt.target.p);
        if p_camera.norm() > self.config.unfold.range.si() || !shows(camera, &p_camera) {
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

    /// Starts the hand towards the fruit, out of the motion that it is in.
    fn home_in(&mut self, views: Views, failed: u32, robot: &RobotState) -> Next {
        match self.steer(robot) {
            Some(()) => Next::Enter(Phase::Grasp(Grasp::homing(views, failed))),
            None => Next::Fail(FailureReason::GraspUnreachable),
        }
    }
}

/// Whether a point of the camera's frame is in the image.
fn shows(camera: &Intrinsics, p_camera: &Vec3) -> bool {
    let (width, height) = (camera.width as f64, camera.height as f64);
    camera.project(p_camera).is_some_and(|(u, v)| u >= 0.0 && v >= 0.0 && u < width && v < height)
}
