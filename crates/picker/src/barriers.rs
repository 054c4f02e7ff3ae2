//! Barriers: ways on which something has held the base. They are not driven again.
//!
//! Posts and wires of a trellis stand where the camera does not look while the base goes around a tree.

use crate::config::PickerConfig;
use crate::drive::{BaseGoal, bearing_of};
use crate::robot_state::RobotState;
use nalgebra::Vector2;
use orchard_geometry::{Vec3, math};

/// Ways that are closed to the base.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Barriers {
    /// True if barriers are remembered at all.
    pub kept: bool,
    found: Vec<Barrier>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Barrier {
    /// Around the tree from a bearing \[rad\] on, to the left (1) or to the right (-1).
    Around { bearing: f64, side: f64 },
    /// Straight on from a place in a direction, odom.
    Ahead { p: Vector2<f64>, direction: Vector2<f64> },
}

impl Barriers {
    /// Adds what holds the base on its way to a goal around a tree (odom).
    pub fn add(&mut self, robot: &RobotState, goal: &BaseGoal, tree: &Vec3, config: &PickerConfig) {
        if !self.kept {
            return;
        }
        let (bearing, swing) = swing_to(robot, goal, tree);
        let barrier = if swing.abs() > config.drive.orbit_angle.si() {
            Barrier::Around { bearing, side: swing.signum() }
        } else {
            let way = way_to(robot, goal);
            Barrier::Ahead { p: robot.p_odom().xy(), direction: way / way.norm().max(f64::EPSILON) }
        };
        self.found.push(barrier);
    }

    /// True if a barrier stands between the base and a goal around a tree (odom).
    pub fn bar(&self, robot: &RobotState, goal: &BaseGoal, tree: &Vec3, config: &PickerConfig) -> bool {
        self.found.iter().any(|barrier| match barrier {
            Barrier::Around { bearing, side } => {
                let (here, swing) = swing_to(robot, goal, tree);
                // The base stands a little beyond or before it afterwards.
                let left = math::wrap_angle(bearing - here) * side;
                swing * side > left.max(0.0) && left > -config.drive.orbit_angle.si()
            }
            Barrier::Ahead { p, direction } => {
                let (here, way) = (robot.p_odom().xy() - p, way_to(robot, goal));
                let there = here + way;
                let (half_x, half_y) = (config.align.body_half_x.si(), config.align.body_half_y.si());
                let is_beyond = there.dot(direction) > config.align.position_tolerance.si();
                is_beyond && here.dot(direction) < half_x && there.perp(direction).abs() < half_y
            }
        })
    }
}

/// Bearing of the base about the tree, and the way around it to a goal by the shorter side \[rad\].
fn swing_to(robot: &RobotState, goal: &BaseGoal, tree: &Vec3) -> (f64, f64) {
    let here = bearing_of(&robot.p_odom(), tree);
    (here, math::wrap_angle(bearing_of(&Vec3::new(goal.x, goal.y, 0.0), tree) - here))
}

fn way_to(robot: &RobotState, goal: &BaseGoal) -> Vector2<f64> {
    Vector2::new(goal.x - robot.base_pose[0], goal.y - robot.base_pose[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;

    const TREE: Vec3 = Vec3::new(2.0, 0.0, 0.0);

    fn at(bearing: f64) -> RobotState {
        let goal = BaseGoal::facing(&TREE, bearing, 1.5);
        RobotState { base_pose: [goal.x, goal.y, goal.yaw], ..RobotState::still(0.0) }
    }

    /// A barrier on the way to the left closes what lies beyond it, neither the near places nor those to the right; a picker that keeps none
    /// is closed to nothing.
    #[test]
    fn a_barrier_closes_its_side() {
        let config = ExpertConfig::preset().shared;
        let goal = |bearing: f64| BaseGoal::facing(&TREE, bearing, 0.9);
        let mut barriers = Barriers { kept: true, ..Barriers::default() };
        barriers.add(&at(1.0), &goal(2.5), &TREE, &config);
        let bars = |from: f64, to: f64| barriers.bar(&at(from), &goal(to), &TREE, &config);
        assert!(bars(1.0, 1.8) && bars(0.2, 1.8) && bars(0.9, 1.2) && bars(1.1, 2.0));
        assert!(!bars(0.2, 0.9) && !bars(1.0, 0.3) && !bars(0.2, -1.0) && !bars(2.0, 2.6));
        let mut careless = Barriers::default();
        careless.add(&at(1.0), &goal(2.5), &TREE, &config);
        assert_eq!(careless, Barriers::default());
    }

    /// What holds the base on a straight way closes the lane before it.
    #[test]
    fn a_barrier_closes_the_lane_ahead() {
        let config = ExpertConfig::preset().shared;
        let place = |x: f64, y: f64| BaseGoal { x, y, yaw: 0.0 };
        let robot = |x: f64, y: f64| RobotState { base_pose: [x, y, 0.0], ..RobotState::still(0.0) };
        let mut barriers = Barriers { kept: true, ..Barriers::default() };
        barriers.add(&robot(0.5, 0.0), &place(1.0, 0.0), &TREE, &config);
        let bars = |from: &RobotState, to: BaseGoal| barriers.bar(from, &to, &TREE, &config);
        assert!(bars(&robot(0.5, 0.0), place(0.9, 0.1)) && bars(&robot(0.0, 0.0), place(0.9, -0.2)));
        assert!(!bars(&robot(0.0, 0.0), place(0.4, 0.0)) && !bars(&robot(0.0, 0.6), place(0.9, 0.6)));
    }
}
