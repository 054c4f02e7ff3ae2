//! Grasp: home in on the fruit, close, check that it is in hand; else look again and try once more.

use crate::expert::approach::{Reach, Views};
use crate::expert::pull::Pull;
use crate::expert::{Care, ExpertPicker, Next, Phase};
use crate::plan::{Target, in_sweep};
use crate::record::FailureReason;
use crate::rig::{Fingers, STILL};
use crate::robot_state::RobotState;
use orchard_geometry::{Pose, Vec3, inverse_transform};
use orchard_robot::Obstacle;
use std::collections::BTreeMap;

/// Memory of the grasp state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grasp {
    stage: Stage,
    views: Views,
    /// Tries at this target that came to nothing.
    failed: u32,
    /// Whether something stopped the hand.
    refused: bool,
    /// Smoothed push of what is before the hand [N].
    push: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// On the way to the fruit.
    Homing,
    /// Closing since a time.
    Closing { since: f64, width: f64, steady: f64 },
    /// Backing out for another look, fingers opening since a time.
    Opening { since: f64 },
    /// On the way back.
    Backing,
    /// A named fruit is in hand, and that is all that was asked.
    Holding,
}

impl Grasp {
    pub fn homing(views: Views, failed: u32) -> Self {
        Self { stage: Stage::Homing, views, failed, refused: false, push: 0.0 }
    }

    /// Opens for another try at a fruit that left the fingers while still on its stem.
    pub fn lost(robot: &RobotState, failed: u32) -> Self {
        let stage = Stage::Opening { since: robot.time };
        Self { stage, views: Views::new(), failed, refused: false, push: 0.0 }
    }
}

impl ExpertPicker {
    /// Aims the hand at the target as it is known now.
    pub(crate) fn steer(&mut self, robot: &RobotState) -> Option<()> {
        let target = self.rig.target_base(robot)?;
        let rotation = self.rig.attempt.as_ref()?.plan.rotation;
        let p_goal = target.p + rotation * Vec3::z() * self.rig.config.approach.overshoot.si();
        let x_goal = Pose::from_parts(p_goal.into(), rotation);
        let obstacles = self.obstacles(&target, &x_goal, robot);
        self.rig.motion.home_in(&self.rig.arm, x_goal, obstacles, &self.config.homing);
        Some(())
    }

    /// What was seen about the way to a grasp, outside the hand's straight path, where nothing can be spared.
    fn obstacles(&self, target: &Target, x_goal: &Pose, robot: &RobotState) -> Vec<Obstacle> {
        let c = &self.config.homing;
        let (clearance, penalty) = (c.clearance.si(), c.clearance_cost.si());
        if penalty <= 0.0 {
            return Vec::new();
        }
        let p_tcp = self.rig.arm.tcp(&robot.q).translation.vector;
        let own = target.radius + self.rig.config.approach.fruit_margin.si();
        let (range, grid) = (c.clearance_range.si(), c.clearance_grid.si());
        let counts = |p: &Vec3| {
            let off = (p - target.p).norm();
            off > own
                && (off < range || (p - p_tcp).norm() < range)
                && !in_sweep(&inverse_transform(x_goal, p), &self.rig.config)
        };
        // The last seen of each cell, in the order of the grid.
        let cells: BTreeMap<[i64; 3], Vec3> = self
            .rig
            .points_base(robot)
            .into_iter()
            .filter(counts)
            .map(|p| ([p.x, p.y, p.z].map(|x| (x / grid).floor() as i64), p))
            .collect();
        cells.into_values().map(|p_base| Obstacle { p_base, clearance, penalty }).collect()
    }

    pub(crate) fn grasp(&mut self, mut grasp: Grasp, robot: &RobotState) -> Next {
        if grasp.stage != Stage::Holding && self.rig.elapsed(robot) > self.rig.config.timeout.grasp.si() {
            return Next::Fail(FailureReason::GraspStalled);
        }
        match grasp.stage {
            Stage::Homing => self.advance(grasp, robot),
            Stage::Holding => Next::Stay(Phase::Grasp(grasp), STILL),
            Stage::Closing { since, width, steady } => {
                let is_steady = (robot.width - width).abs() <= self.rig.config.grasp.steady_width.si();
                let steady = if is_steady { steady + robot.dt } else { 0.0 };
                let late = robot.time - since >= self.rig.config.grasp.close_time.si();
                if steady < self.config.feel.steady_time.si() && !late {
                    grasp.stage = Stage::Closing { since, width: robot.width, steady };
                } else if self.in_hand(robot) {
                    self.rig.note_grasp(robot);
                    if self.rig.errand.is_none() {
                        return self.start_pull(grasp.failed);
                    }
                    grasp.stage = Stage::Holding;
                } else {
                    return self.try_again(grasp, FailureReason::NoFruitAtDetection, robot);
                }
                Next::Stay(Phase::Grasp(grasp), STILL)
            }
            Stage::Opening { since } => {
                let open = self.rig.fingers_are_open(robot);
                if open || robot.time - since >= self.config.place.open_time.si() {
                    self.back_out(robot);
                    grasp.stage = Stage::Backing;
                }
                Next::Stay(Phase::Grasp(grasp), STILL)
            }
            Stage::Backing if !self.rig.motion.is_over() => Next::Stay(Phase::Grasp(grasp), STILL),
            Stage::Backing => {
                let q = *self.rig.motion.q();
                if let Some(attempt) = &mut self.rig.attempt {
                    attempt.plan.q_look = q;
                    // Only what is seen anew counts, but for a place that was named.
                    attempt.hits = if self.rig.errand.is_some() { attempt.hits } else { 0 };
                }
                if grasp.refused && !self.turn_away(robot) {
                    return Next::Fail(FailureReason::GraspStalled);
                }
                Next::Enter(Phase::Reach(Reach::new(grasp.failed)))
            }
        }
    }

    /// Whether the fingers press on something as wide as a fruit.
    fn in_hand(&self, robot: &RobotState) -> bool {
        let pressed = self.config.feel.squeeze.si() * self.rig.fingers.force;
        self.rig.holds_fruit(robot) && robot.finger_force.iter().all(|f| f.abs() >= pressed)
    }

    fn advance(&mut self, mut grasp: Grasp, robot: &RobotState) -> Next {
        if self.view(&mut grasp.views) && self.steer(robot).is_none() {
            return Next::Fail(FailureReason::GraspUnreachable);
        }
        let (Some(target), Some(attempt)) = (self.rig.target_base(robot), &self.rig.attempt) else {
            return Next::Fail(FailureReason::GraspStalled);
        };
        let (direction, met) = (attempt.plan.direction(), attempt.plan.met);
        let p_goal = target.p + direction * self.rig.config.approach.overshoot.si();
        let left = (self.rig.arm.tcp(&robot.q).translation.vector - p_goal).norm();
        let near = left <= self.rig.config.grasp.close_near.si();
        let c = &self.config.homing;
        let push = self.rig.tcp_force(robot).dot(&direction);
        if push.is_finite() {
            grasp.push += (push - grasp.push) * c.push_weight.si();
        }
        let room = 1.0 - grasp.push / c.push_max.si();
        let pushed = room < 0.0 || self.is_pressed() || self.rig.arm_stalled();
        let crowd = c.crowd.si();
        let careful = self.share_of_speed(Care::after(grasp.failed));
        let pace = room.min(careful * crowd / (crowd + met as f64));
        self.rig.motion.set_homing_pace(pace.clamp(c.pace_min.si(), 1.0));
        if !near && self.rig.motion.is_lost() {
            return self.try_again(grasp, FailureReason::GraspUnreachable, robot);
        }
        if !near && pushed {
            self.rig.note_yielding(robot, grasp.push.max(self.touch));
            return self.try_again(grasp, FailureReason::GraspStalled, robot);
        }
        if !(self.rig.arm_arrived(robot) || (near && (pushed || self.rig.motion.is_over()))) {
            return Next::Stay(Phase::Grasp(grasp), STILL);
        }
        self.rig.motion.stop();
        self.rig.fingers = Fingers { opening: 0.0, force: self.rig.config.grasp.force.si() };
        grasp.stage = Stage::Closing { since: robot.time, width: f64::INFINITY, steady: 0.0 };
        Next::Stay(Phase::Grasp(grasp), STILL)
    }

    /// Backs out for another try, if one is left. A direction in which wood stopped the hand is not tried again.
    fn try_again(&mut self, mut grasp: Grasp, reason: FailureReason, robot: &RobotState) -> Next {
        grasp.failed += 1;
        if grasp.failed >= self.config.homing.tries.get() {
            return Next::Fail(reason);
        }
        self.rig.yield_arm(robot);
        self.rig.open_fingers();
        self.rig.restart_clock(robot);
        grasp.refused = reason != FailureReason::NoFruitAtDetection;
        grasp.stage = Stage::Opening { since: robot.time };
        Next::Stay(Phase::Grasp(grasp), STILL)
    }

    /// Starts the hand back along the approach, from where it is to where it looked.
    fn back_out(&mut self, robot: &RobotState) {
        if let Some(attempt) = &self.rig.attempt {
            self.withdraw(-attempt.plan.direction(), robot);
        }
    }

    /// Starts the hand along `direction` (base frame) by the length of an approach. What the hand touches may have held
    /// it off its command, so it starts from where it is.
    pub(crate) fn withdraw(&mut self, direction: Vec3, robot: &RobotState) {
        let (way, speed) = (self.rig.config.approach.look.si(), self.rig.config.arm.approach_speed.si());
        self.rig.yield_arm(robot);
        self.rig.motion.go_straight(&self.rig.arm, direction, way, speed, &self.rig.config.arm);
        // What presses on the hand breaks within a few frames.
        self.rig.motion.set_line_acceleration(self.config.leave.acceleration.si());
    }

    fn start_pull(&mut self, failed: u32) -> Next {
        let Some(attempt) = &self.rig.attempt else { return Next::Fail(FailureReason::Slipped) };
        let c = &self.rig.config;
        let (way, speed) = (c.pull.distance.si(), c.arm.withdraw_speed.si());
        self.rig.motion.go_straight(&self.rig.arm, -attempt.plan.direction(), way, speed, &c.arm);
        Next::Enter(Phase::Pull(Pull::new(failed)))
    }
}
