//! Ways in which the robot's base can move, and the places that it can take.

use crate::config::DriveConfig;
use crate::drive::{BaseGoal, Tolerance, drive};
use crate::robot_state::RobotState;
use orchard_geometry::{Vec3, math};
use orchard_robot::{BaseJoint, RobotModel, Steering};

/// Ways in which the base can move.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Mobility {
    /// The base stands.
    Stands,
    /// The base slides on a rail.
    Rail {
        /// Direction of the rail in the base frame and, as the base does not turn, in odom; a unit vector.
        axis: Vec3,
        /// Ends of the rail \[m\].
        lower: f64,
        upper: f64,
    },
    /// The base drives on the ground.
    Ground(Steering),
}

impl Mobility {
    /// Returns the ways in which a robot can move.
    pub fn of(robot: &RobotModel) -> Self {
        let drive = robot.config().drive.as_ref();
        match (robot.base_joint(), drive) {
            (BaseJoint::Planar(_), Some(drive)) => Self::Ground(drive.steering.clone()),
            (BaseJoint::Rail { on, axis_base }, Some(_)) => {
                let limit = robot.articulation().links[on].limit;
                let (lower, upper) = limit.map_or((0.0, 0.0), |limit| (limit.lower, limit.upper));
                Self::Rail { axis: axis_base, lower, upper }
            }
            _ => Self::Stands,
        }
    }

    /// True if the base can take any pose on the ground.
    pub fn is_free(&self) -> bool {
        matches!(self, Self::Ground(_))
    }

    /// Returns the place nearest to a wanted one that a base which cannot leave its rail or its spot can take.
    pub fn nearest(&self, robot: &RobotState, wanted: &BaseGoal) -> BaseGoal {
        let [x, y, yaw] = robot.base_pose;
        match self {
            Self::Ground(_) => *wanted,
            Self::Stands => BaseGoal { x, y, yaw },
            Self::Rail { axis, lower, upper } => {
                let along = (wanted.x * axis.x + wanted.y * axis.y).clamp(*lower, *upper);
                BaseGoal { x: axis.x * along, y: axis.y * along, yaw }
            }
        }
    }

    /// Returns the velocity towards a goal in the base frame [m/s, m/s, rad/s], and true if the goal is reached.
    pub fn towards(
        &self,
        robot: &RobotState,
        goal: &BaseGoal,
        tree: &Vec3,
        c: &DriveConfig,
        tolerance: Tolerance,
    ) -> ([f64; 3], bool) {
        match self {
            Self::Ground(Steering::Holonomic) => drive(robot, goal, tree, c, tolerance),
            Self::Ground(_) => turn_and_drive(robot, goal, tree, c, tolerance),
            Self::Stands => ([0.0; 3], true),
            Self::Rail { axis, .. } => {
                let goal = self.nearest(robot, goal);
                let [x, y, _] = robot.base_pose;
                let left = (goal.x - x) * axis.x + (goal.y - y) * axis.y;
                let speed = (left * c.gain.si()).clamp(-c.speed.si(), c.speed.si());
                match tolerance.meets(left.abs(), 0.0) {
                    true => ([0.0; 3], true),
                    false => ([axis.x * speed, axis.y * speed, 0.0], false),
                }
            }
        }
    }
}

/// Follows the way of [`drive`] with a base that cannot move sideways: it turns until it points along or against the way, and drives while
/// it does; at the goal it turns to the goal's heading.
fn turn_and_drive(
    robot: &RobotState,
    goal: &BaseGoal,
    tree: &Vec3,
    c: &DriveConfig,
    tolerance: Tolerance,
) -> ([f64; 3], bool) {
    let ([forward, left, turn], reached) = drive(robot, goal, tree, c, tolerance);
    if reached || tolerance.meets(goal.distance(robot), 0.0) {
        return ([0.0, 0.0, turn], reached);
    }
    let way = math::atan2(left, forward);
    // Backwards where that takes the smaller turn.
    let (off, sense) = match way.abs() <= std::f64::consts::FRAC_PI_2 {
        true => (way, 1.0),
        false => (math::wrap_angle(way + std::f64::consts::PI), -1.0),
    };
    let limit = c.turn_speed.si();
    let turn = (off * c.gain.si()).clamp(-limit, limit);
    // Full speed along the way, none across it.
    let aligned = math::cos(off).max(0.0);
    let along = math::hypot(forward, left) * sense * aligned * aligned * aligned;
    ([along, 0.0, turn], false)
}
