//! Trail: the way that the base has come, which leads it back out of what it has driven into.
//!
//! Between posts and under wires a base finds room only where it came through. It goes back pose by pose, turns included.

use crate::drive::BaseGoal;
use crate::robot_state::{RobotState, turned};
use orchard_geometry::math;
use std::collections::VecDeque;

/// Way between two poses of the trail \[m\]; our choice.
const STEP: f64 = 0.03;
/// Number of poses kept; our choice, 3 m of way.
const KEPT: usize = 100;
/// Length of way that a turn by 1 rad counts as \[m/rad\]; our choice, about half the length of a chassis.
const LEVER: f64 = 0.5;

/// Poses of the base (odom), the latest last.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Trail {
    poses: VecDeque<BaseGoal>,
    /// True in a frame in which the base goes back on it.
    retraced: bool,
}

impl Trail {
    /// Adds the present pose, if the base has moved on and does not go back.
    pub fn keep(&mut self, robot: &RobotState) {
        let moved = self.poses.back().is_none_or(|last| way(&robot.base_pose, last) >= STEP);
        if moved && !self.retraced {
            let [x, y, yaw] = robot.base_pose;
            self.poses.push_back(BaseGoal { x, y, yaw });
            if self.poses.len() > KEPT {
                self.poses.pop_front();
            }
        }
        self.retraced = false;
    }

    /// Goes back on the trail at a speed [m/s], in which a turn counts as way. Returns the velocity in the base frame [m/s, m/s, rad/s], and subtracts the way that the
    /// base has passed from `left`, the way still to go \[m\]. `None` once no way is left, or at the end of the trail.
    pub fn back(&mut self, robot: &RobotState, speed: f64, left: &mut f64) -> Option<[f64; 3]> {
        self.retraced = true;
        while *left > 0.0 {
            let last = self.poses.back()?;
            let to_last = way(&robot.base_pose, last);
            let is_passed =
                self.poses.iter().rev().nth(1).is_some_and(|next| way(&robot.base_pose, next) < to_last);
            if to_last >= STEP && !is_passed {
                let [x, y, yaw] = robot.base_pose;
                let share = speed / to_last;
                let ahead = turned([(last.x - x) * share, (last.y - y) * share], -yaw);
                return Some([ahead[0], ahead[1], math::wrap_angle(last.yaw - yaw) * share]);
            }
            let passed = self.poses.pop_back()?;
            *left -= self.poses.back().map_or(0.0, |last| way(&[passed.x, passed.y, passed.yaw], last));
        }
        None
    }
}

/// Way between two poses \[m\], the turn included.
fn way([x, y, yaw]: &[f64; 3], to: &BaseGoal) -> f64 {
    let turn = math::wrap_angle(to.yaw - yaw);
    math::hypot(math::hypot(to.x - x, to.y - y), LEVER * turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1.0 / 60.0;

    fn drive(robot: &mut RobotState, velocity: [f64; 3]) {
        let [x, y, yaw] = robot.base_pose;
        let [vx, vy] = turned([velocity[0], velocity[1]], yaw);
        robot.place_base([x + DT * vx, y + DT * vy, yaw + DT * velocity[2]]);
    }

    /// A base that has driven in a curve comes back along it, turns included, as far as it is told and no farther than the trail was kept; going back adds nothing to it.
    #[test]
    fn a_base_goes_back_as_it_came() {
        for (told, forward) in [(0.3, 1.0), (100.0, 4.0)] {
            let (mut trail, mut robot) = (Trail::default(), RobotState::still(0.0));
            let mut came = Vec::new();
            for _ in 0..(forward / DT) as u32 {
                trail.keep(&robot);
                came.push(robot.base_pose);
                drive(&mut robot, [1.0, 0.3, 1.0]);
            }
            let end = robot.base_pose;
            let (mut left, mut frames) = (told, 0);
            while let Some(velocity) = trail.back(&robot, 0.3, &mut left) {
                let nearest =
                    came.iter().map(|p| way(&robot.base_pose, &BaseGoal { x: p[0], y: p[1], yaw: p[2] }));
                assert!(nearest.fold(f64::INFINITY, f64::min) < STEP, "{:?}", robot.base_pose);
                drive(&mut robot, velocity);
                trail.keep(&robot);
                frames += 1;
                assert!(frames < 3600, "{:?}", robot.base_pose);
            }
            let [x, y, yaw] = end;
            let gone = way(&robot.base_pose, &BaseGoal { x, y, yaw });
            let speed: f64 = math::hypot(math::hypot(1.0, 0.3), LEVER);
            let (all, kept) = (forward * speed, KEPT as f64 * STEP);
            if told < kept {
                assert!((gone - told).abs() < 2.0 * STEP, "{gone}");
            } else {
                assert!(all > kept && trail.poses.is_empty() && frames > 0);
            }
        }
    }

    /// A base that has not moved has no way back.
    #[test]
    fn without_a_trail_it_stays() {
        let (mut trail, robot) = (Trail::default(), RobotState::still(0.0));
        assert_eq!(trail.back(&robot, 0.3, &mut 1.0), None);
        trail.keep(&robot);
        trail.keep(&robot);
        assert_eq!(trail.back(&robot, 0.3, &mut 1.0), None);
    }
}
