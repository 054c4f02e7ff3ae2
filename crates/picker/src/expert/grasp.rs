//! Grasp: home in on the fruit, close, check that the fruit is in hand; else look again and try once more.

use crate::cloud::SeenPoint;
use crate::expert::views::Views;
use crate::expert::{Caution, ExpertPicker, Next, Phase};
use crate::picker_core::STILL;
use crate::plan::{Target, grasp_depth, in_sweep};
use crate::record::{Alarm, FailureReason};
use crate::robot_state::RobotState;
use orchard_geometry::{Pose, Vec3, inverse_transform};
use orchard_robot::Obstacle;
use std::collections::BTreeMap;

/// Memory of the grasp state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grasp {
    stage: Stage,
    views: Views,
    /// Number of failed tries at this target.
    failed: u32,
    /// True if something stopped the hand.
    refused: bool,
    /// Smoothed push against the hand along the approach \[N\].
    push: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Moving to the fruit.
    Homing,
    /// Fingers closing since a time \[s\].
    Closing { since: f64, width: f64, steady: f64 },
    /// Fingers opening since a time \[s\], before the hand backs out for another look.
    Opening { since: f64 },
    /// Backing out.
    Backing,
    /// Holding the fruit of an assigned task.
    Holding,
}

impl Grasp {
    fn homing(views: Views, failed: u32) -> Self {
        Self { stage: Stage::Homing, views, failed, refused: false, push: 0.0 }
    }

    /// True while the hand moves to the fruit by its images.
    pub fn is_homing(&self) -> bool {
        self.stage == Stage::Homing
    }

    /// Starts by opening the fingers.
    fn lost(robot: &RobotState, failed: u32) -> Self {
        let stage = Stage::Opening { since: robot.time };
        Self { stage, views: Views::new(), failed, refused: false, push: 0.0 }
    }
}

impl ExpertPicker {
    /// Starts the hand towards the fruit from its present motion.
    pub(crate) fn home_in(&mut self, views: Views, failed: u32, robot: &RobotState) -> Next {
        match self.steer(robot) {
            Some(()) => Next::Enter(Phase::Grasp(Grasp::homing(views, failed))),
            None => Next::Fail(FailureReason::GraspUnreachable),
        }
    }

    /// Tries again, if a try is left, after the fruit has slipped from the fingers while still on its stem.
    pub(crate) fn grasp_again(&mut self, failed: u32, robot: &RobotState) -> Next {
        let failed = failed + 1;
        if failed >= self.config.homing.tries.get() {
            return Next::Fail(FailureReason::Slipped);
        }
        self.core.motion.stop();
        self.core.open_fingers();
        Next::Enter(Phase::Grasp(Grasp::lost(robot, failed)))
    }

    /// Pose of the TCP at the grasp of the present estimate of the target, base frame.
    fn x_grasp(&self, robot: &RobotState) -> Option<(Target, Pose)> {
        let target = self.core.target_base(robot)?;
        let rotation = self.core.attempt.as_ref()?.plan.rotation;
        let depth = grasp_depth(&self.core.arm, target.radius, &self.core.config);
        let p_goal = target.p + rotation * Vec3::z() * depth;
        Some((target, Pose::from_parts(p_goal.into(), rotation)))
    }

    /// Sets the hand's goal to the present estimate of the target.
    fn steer(&mut self, robot: &RobotState) -> Option<()> {
        let (target, x_goal) = self.x_grasp(robot)?;
        let obstacles = self.obstacles(&target, &x_goal, robot);
        self.core.motion.home_in(&self.core.arm, x_goal, obstacles, &self.config.homing);
        Some(())
    }

    /// Returns the seen points near the hand and the fruit as obstacles. Points in the hand's straight path are left out: it cannot avoid
    /// them.
    fn obstacles(&self, target: &Target, x_goal: &Pose, robot: &RobotState) -> Vec<Obstacle> {
        let c = &self.config.homing;
        let (clearance, of_leaf, of_wood) = (c.clearance.si(), c.clearance_cost.si(), c.wood_cost.si());
        if of_leaf.max(of_wood) <= 0.0 {
            return Vec::new();
        }
        let p_tcp = self.core.arm.tcp(&robot.q).translation.vector;
        let own = target.radius + self.core.config.approach.fruit_margin.si();
        let (range, grid) = (c.clearance_range.si(), c.clearance_grid.si());
        let counts = |SeenPoint { p, .. }: &SeenPoint| {
            let off = (p - target.p).norm();
            off > own
                && (off < range || (p - p_tcp).norm() < range)
                && !in_sweep(&inverse_transform(x_goal, p), &self.core.config)
        };
        let cube = |p: &Vec3| [p.x, p.y, p.z].map(|x| (x / grid).floor() as i64);
        // The last point of wood and of leaves in each cube, in the order of the grid.
        let points = self.core.points_base(robot).into_iter().filter(counts);
        let cells: BTreeMap<_, _> = points.map(|point| ((cube(&point.p), point.is_wood), point)).collect();
        let obstacle = |SeenPoint { p, is_wood }| Obstacle {
            p_base: p,
            clearance,
            penalty: if is_wood { of_wood } else { of_leaf },
        };
        cells.into_values().map(obstacle).collect()
    }

    pub(crate) fn grasp(&mut self, mut grasp: Grasp, robot: &RobotState) -> Next {
        if grasp.stage != Stage::Holding && self.core.elapsed(robot) > self.core.config.timeout.grasp.si() {
            return Next::Fail(FailureReason::GraspStalled);
        }
        match grasp.stage {
            Stage::Homing => self.advance(grasp, robot),
            Stage::Holding => Next::Stay(Phase::Grasp(grasp), STILL),
            Stage::Closing { since, width, steady } => {
                let is_steady = (robot.width - width).abs() <= self.core.config.grasp.steady_width.si();
                let steady = if is_steady { steady + robot.dt } else { 0.0 };
                let late = robot.time - since >= self.core.config.grasp.close_time.si();
                let closed = self.core.has_closed(steady, self.config.feel.steady_time.si(), robot);
                // Fingers that have not begun to move yet are steady, but do not press.
                if !(late || closed && self.is_pressing(robot)) {
                    grasp.stage = Stage::Closing { since, width: robot.width, steady };
                } else if self.in_hand(robot) {
                    self.core.note_grasp(robot);
                    if self.core.task.is_none() {
                        return self.start_pull(grasp.failed, robot);
                    }
                    grasp.stage = Stage::Holding;
                } else if self.core.arm.cup().is_none() && self.core.fingers_are_open(robot) {
                    self.raise(Alarm::HandStuck, robot.time);
                    return Next::Fail(FailureReason::HandStuck);
                } else {
                    return self.try_again(grasp, FailureReason::NoFruitAtDetection, robot);
                }
                Next::Stay(Phase::Grasp(grasp), STILL)
            }
            Stage::Opening { since } => {
                let open = self.core.fingers_are_open(robot);
                if open || robot.time - since >= self.config.place.open_time.si() {
                    self.back_out(robot);
                    grasp.stage = Stage::Backing;
                }
                Next::Stay(Phase::Grasp(grasp), STILL)
            }
            Stage::Backing if !self.core.motion.is_over() => {
                if let Some(direction) = self.core.attempt.as_ref().map(|a| -a.plan.direction()) {
                    self.slip_out(&direction, self.core.config.arm.approach_speed.si());
                }
                Next::Stay(Phase::Grasp(grasp), STILL)
            }
            Stage::Backing => self.look_again(grasp.refused, grasp.failed, robot),
        }
    }

    /// True if the fingers press on something as wide as a fruit, or the cup is sealed.
    fn in_hand(&self, robot: &RobotState) -> bool {
        if self.core.arm.cup().is_some() {
            return self.core.holds_fruit(robot);
        }
        self.core.holds_fruit(robot) && self.is_pressing(robot)
    }

    /// True if both fingers press, on the fruit or on each other; always true of a cup.
    fn is_pressing(&self, robot: &RobotState) -> bool {
        let pressed = self.config.feel.squeeze.si() * self.core.fingers.force;
        self.core.arm.cup().is_some() || robot.finger_force.iter().all(|f| f.abs() >= pressed)
    }

    fn advance(&mut self, mut grasp: Grasp, robot: &RobotState) -> Next {
        if self.view(&mut grasp.views) {
            if self.steer(robot).is_none() {
                return Next::Fail(FailureReason::GraspUnreachable);
            }
        } else if let (true, Some((_, x_goal))) = (self.core.config.sensors.base_motion, self.x_grasp(robot))
        {
            // The base may have moved since the last image.
            self.core.motion.aim(x_goal);
        }
        let (Some(target), Some(attempt)) = (self.core.target_base(robot), &self.core.attempt) else {
            return Next::Fail(FailureReason::GraspStalled);
        };
        let (direction, met) = (attempt.plan.direction(), attempt.plan.met);
        let p_goal = target.p + direction * grasp_depth(&self.core.arm, target.radius, &self.core.config);
        let off = self.core.arm.tcp(&robot.q).translation.vector - p_goal;
        let left = off.norm();
        let near = left <= self.core.config.grasp.close_near.si();
        let c = &self.config.homing;
        let push = self.core.tcp_force(robot).dot(&direction);
        if push.is_finite() {
            grasp.push += (push - grasp.push) * c.push_weight.si();
        }
        let room = 1.0 - grasp.push / c.push_max.si();
        let pushed = room < 0.0 || self.is_pressed() || self.core.arm_stalled();
        let crowd = c.crowd.si();
        let careful = self.speed_share(Caution::after(grasp.failed));
        let pace = room.min(careful * crowd / (crowd + met));
        let mut pace = pace.clamp(c.pace_min.si(), 1.0);
        if self.core.arm.cup().is_some() {
            pace = pace.min(self.pace_of_cup(&off, &direction, near, robot));
        }
        if self.core.touches_down(left) {
            self.core.close_hand();
        }
        self.core.motion.set_homing_pace(pace);
        if !near && self.core.motion.is_lost() {
            return self.try_again(grasp, FailureReason::GraspUnreachable, robot);
        }
        if !near && pushed {
            self.core.note_yielding(robot, grasp.push.max(self.force.norm()));
            return self.try_again(grasp, FailureReason::GraspStalled, robot);
        }
        let sealed = self.core.is_sealed(robot);
        if !(sealed || self.core.arm_arrived(robot) || (near && (pushed || self.core.motion.is_over()))) {
            return Next::Stay(Phase::Grasp(grasp), STILL);
        }
        self.core.motion.stop();
        self.core.close_hand();
        grasp.stage = Stage::Closing { since: robot.time, width: f64::INFINITY, steady: 0.0 };
        Next::Stay(Phase::Grasp(grasp), STILL)
    }

    /// Share of its speeds at which a cup homes in: slowly before the fruit, more slowly the more the arm lags sideways behind its command, and
    /// not at all before the fruit while the lip is beside its line. `off` is the way from the goal to the TCP \[m\].
    fn pace_of_cup(&self, off: &Vec3, direction: &Vec3, near: bool, robot: &RobotState) -> f64 {
        let touch = &self.core.config.suction;
        let aside = |v: &Vec3| (v - direction * v.dot(direction)).norm();
        let lateral_max = touch.lateral_max.si();
        let tcp = |q| self.core.arm.tcp(q).translation.vector;
        let lag = aside(&(tcp(self.core.motion.q()) - tcp(&robot.q)));
        let pace = if lag > lateral_max { lateral_max / lag } else { 1.0 };
        if !self.core.touches_down(off.norm()) {
            return pace;
        }
        if aside(off) > lateral_max && !near {
            return 0.0;
        }
        pace.min(touch.touch_speed.si() / self.config.homing.speed.si())
    }

    /// Backs out for another try, if one is left. A direction in which wood stopped the hand is not tried again.
    fn try_again(&mut self, mut grasp: Grasp, reason: FailureReason, robot: &RobotState) -> Next {
        grasp.failed += 1;
        if grasp.failed >= self.config.homing.tries.get() {
            return Next::Fail(reason);
        }
        self.core.yield_arm(robot);
        self.core.open_fingers();
        self.core.restart_clock(robot);
        grasp.refused = reason != FailureReason::NoFruitAtDetection;
        grasp.stage = Stage::Opening { since: robot.time };
        Next::Stay(Phase::Grasp(grasp), STILL)
    }

    /// Starts the hand back along the approach, to the look posture.
    fn back_out(&mut self, robot: &RobotState) {
        if let Some(attempt) = &self.core.attempt {
            self.withdraw(-attempt.plan.direction(), robot);
        }
    }

    /// Starts the hand along `direction` (base frame) by the length of an approach. An obstacle may have held the hand off its command, so
    /// the motion starts at its actual posture.
    pub(crate) fn withdraw(&mut self, direction: Vec3, robot: &RobotState) {
        let (distance, speed) =
            (self.core.config.approach.look.si(), self.core.config.arm.approach_speed.si());
        self.core.yield_arm(robot);
        self.core.motion.go_straight(&self.core.arm, direction, distance, speed, &self.core.config.arm);
        // A branch that presses on the hand would break within a few frames.
        self.core.motion.set_line_acceleration(self.config.leave.acceleration.si());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;
    use orchard_perception::DetectorConfig;
    use orchard_robot::RobotModel;

    /// Fingers whose command is still under way are steady; the hand waits for them until they press, or until they are late.
    #[test]
    fn fingers_that_have_not_moved_are_waited_for() {
        let robot = RobotModel::paper();
        let mut picker = ExpertPicker::new(&robot, DetectorConfig::paper(), ExpertConfig::preset());
        picker.core.close_hand();
        let force = picker.core.fingers.force;
        let mut closes = |time: f64, width: f64, finger_force: f64| {
            let steady = picker.config.feel.steady_time.si();
            let closing = Stage::Closing { since: 0.0, width, steady };
            let grasp = Grasp { stage: closing, ..Grasp::homing(Views::new(), 0) };
            let felt = RobotState { width, finger_force: [finger_force; 2], ..RobotState::still(time) };
            !matches!(
                picker.grasp(grasp, &felt),
                Next::Stay(Phase::Grasp(Grasp { stage: Stage::Closing { .. }, .. }), _)
            )
        };
        assert!(!closes(0.1, 0.08, 0.0));
        assert!(closes(0.1, 0.06, -force));
        assert!(closes(1.0, 0.08, 0.0));
    }
}
