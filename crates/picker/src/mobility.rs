//! Ways in which the robot's base can move, and the places that it can take.

use crate::config::DriveConfig;
use crate::drive::{BaseGoal, Tolerance, bearing_of, drive};
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
    /// The base drives on the ground in any direction.
    Ground,
    /// The base drives on the ground along its heading.
    Wheels(Wheels),
}

/// Limits of a base that drives along its heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wheels {
    /// Largest acceleration [m/s2].
    pub acceleration: f64,
    /// Largest angular acceleration [rad/s2].
    pub turn_acceleration: f64,
}

impl Mobility {
    /// Returns the ways in which a robot can move.
    pub fn of(robot: &RobotModel) -> Self {
        let drive = robot.config().drive.as_ref();
        match (robot.base_joint(), drive) {
            (BaseJoint::Planar(_), Some(drive)) if drive.steering == Steering::Holonomic => Self::Ground,
            (BaseJoint::Planar(_), Some(drive)) => Self::Wheels(Wheels {
                acceleration: drive.acceleration_max.si(),
                turn_acceleration: drive.turn_acceleration_max.si(),
            }),
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
        matches!(self, Self::Ground | Self::Wheels(_))
    }

    /// Length of the drive to a place around the tree, in metres of straight way; a base on wheels turns at the rate of the config, and a turn
    /// counts as the way that it could drive meanwhile.
    pub fn effort(
        &self,
        robot: &RobotState,
        goal: &BaseGoal,
        tree: &Vec3,
        c: &DriveConfig,
        tolerance: Tolerance,
    ) -> f64 {
        let p_goal = Vec3::new(goal.x, goal.y, 0.0);
        let swing = math::wrap_angle(bearing_of(&p_goal, tree) - bearing_of(&robot.p_odom(), tree)).abs();
        let way = p_goal - robot.p_odom();
        let length = way.norm() + swing * c.orbit_radius.si();
        let Self::Wheels(_) = self else { return length };
        let yaw = robot.base_pose[2];
        let turns = if swing > c.orbit_angle.si() {
            // Out of the heading to the tree and back into it.
            std::f64::consts::PI
        } else if tolerance.meets(way.norm(), 0.0) {
            math::wrap_angle(goal.yaw - yaw).abs()
        } else {
            let course = math::atan2(way.y, way.x);
            let (off, _) = sensed(math::wrap_angle(course - yaw));
            off.abs() + math::wrap_angle(goal.yaw - yaw - off).abs()
        };
        let straight = if swing > c.orbit_angle.si() { length } else { way.norm() };
        straight + turns * c.speed.si() / c.turn_speed.si()
    }

    /// Places on the line of the base's heading, with that heading, from which a base on wheels has a point (odom) at one of the distances \[m\];
    /// its present place first if it lies between them. None for other bases.
    pub fn straight_ahead(&self, robot: &RobotState, p_odom: &Vec3, distances: &[f64]) -> Vec<BaseGoal> {
        let Self::Wheels(_) = self else { return Vec::new() };
        let [x, y, yaw] = robot.base_pose;
        let (sin, cos) = math::sin_cos(yaw);
        let off = p_odom - robot.p_odom();
        let (ahead, aside) = (off.x * cos + off.y * sin, off.y * cos - off.x * sin);
        let (low, high) = distances.iter().fold((f64::INFINITY, 0.0), |(a, b), d| (d.min(a), d.max(b)));
        let here = (ahead > 0.0 && (low..=high).contains(&math::hypot(ahead, aside))).then_some(0.0);
        let to = distances.iter().filter(|d| **d > aside.abs()).map(|d| ahead - (d * d - aside * aside).sqrt());
        here.into_iter().chain(to).map(|s| BaseGoal { x: x + s * cos, y: y + s * sin, yaw }).collect()
    }

    /// Returns the place nearest to a wanted one that a base which cannot leave its rail or its spot can take.
    pub fn nearest(&self, robot: &RobotState, wanted: &BaseGoal) -> BaseGoal {
        let [x, y, yaw] = robot.base_pose;
        match self {
            Self::Ground | Self::Wheels(_) => *wanted,
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
            Self::Ground => drive(robot, goal, tree, c, tolerance),
            Self::Wheels(wheels) => turn_and_drive(robot, goal, tree, c, tolerance, wheels),
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
///
/// With the distance r to go, the angle a between heading and way, speed `v <= g r cos^3 a` and turn rate `w = g a` both r and |a| only fall:
/// `r' = -v cos a`, `a' = -g a + (v / r) sin a` with `cos^3 a sin a < a`. Speeds from which the base cannot brake in time are cut.
fn turn_and_drive(
    robot: &RobotState,
    goal: &BaseGoal,
    tree: &Vec3,
    c: &DriveConfig,
    tolerance: Tolerance,
    wheels: &Wheels,
) -> ([f64; 3], bool) {
    let ([forward, left, _], reached) = drive(robot, goal, tree, c, tolerance);
    let turn = |off: f64| {
        let brakes = (wheels.turn_acceleration * off.abs()).sqrt();
        let limit = c.turn_speed.si().min(brakes);
        (off * c.gain.si()).clamp(-limit, limit)
    };
    let distance = goal.distance(robot);
    if reached || tolerance.meets(distance, 0.0) {
        let off = math::wrap_angle(goal.yaw - robot.base_pose[2]);
        return ([0.0, 0.0, if reached { 0.0 } else { turn(off) }], reached);
    }
    let (off, sense) = sensed(math::atan2(left, forward));
    // Full speed along the way, none across it.
    let aligned = math::cos(off).max(0.0);
    let speed = math::hypot(forward, left).min((wheels.acceleration * distance).sqrt());
    ([speed * sense * aligned * aligned * aligned, 0.0, turn(off)], false)
}

/// Turn to a course \[rad\] from the heading, and 1 if it is driven forwards or -1 if backwards, where that takes the smaller turn.
fn sensed(course: f64) -> (f64, f64) {
    match course.abs() <= std::f64::consts::FRAC_PI_2 {
        true => (course, 1.0),
        false => (math::wrap_angle(course + std::f64::consts::PI), -1.0),
    }
}

#[cfg(test)]
#[path = "mobility_tests.rs"]
mod tests;
