//! Ways in which the robot's base can move, and the places that it can take.

use crate::config::DriveConfig;
use crate::drive::{BaseGoal, Tolerance, bearing_of, drive};
use crate::robot_state::RobotState;
use orchard_geometry::{Vec3, math};
use orchard_robot::{BaseJoint, RobotModel, Steering};
use std::f64::consts::{FRAC_PI_2, PI};

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
        let way = p_goal - robot.p_odom();
        let Self::Wheels(_) = self else {
            let swing = math::wrap_angle(bearing_of(&p_goal, tree) - bearing_of(&robot.p_odom(), tree));
            return way.norm() + swing.abs() * c.orbit_radius.si();
        };
        let yaw = robot.base_pose[2];
        let turns = if tolerance.meets(way.norm(), 0.0) {
            math::wrap_angle(goal.yaw - yaw).abs()
        } else {
            let (course, _) = way_around(robot, goal, tree, c);
            let straight = math::atan2(way.y, way.x);
            // Around the trunk the base arrives along the disc, not on the straight way.
            let (off, _) = sensed(math::wrap_angle(course - yaw));
            let around = math::wrap_angle(straight - course).abs();
            off.abs() + 2.0 * around + math::wrap_angle(goal.yaw - yaw - off).abs()
        };
        way.norm() + turns * c.speed.si() / c.turn_speed.si()
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
        let to =
            distances.iter().filter(|d| **d > aside.abs()).map(|d| ahead - (d * d - aside * aside).sqrt());
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

    /// Returns the velocity towards a goal in the base frame [m/s, m/s, rad/s], and true if the goal is reached. Without a tree it drives straight.
    pub fn towards(
        &self,
        robot: &RobotState,
        goal: &BaseGoal,
        tree: Option<&Vec3>,
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

/// Drives a base that cannot move sideways on the shortest way around a disc about the trunk: it turns until it points along or against the way, and
/// drives while it does; at the goal it turns to the goal's heading.
///
/// With the distance r to go, the angle a between heading and way, speed `v <= g r cos^6 a` and turn rate `w = g a` both r and |a| only fall on
/// a straight way: `r' = -v cos a`, `a' = -g a + (v / r) sin a` with `cos^6 a sin a < a`. Speeds from which the base cannot brake in time are cut.
fn turn_and_drive(
    robot: &RobotState,
    goal: &BaseGoal,
    tree: Option<&Vec3>,
    c: &DriveConfig,
    tolerance: Tolerance,
    wheels: &Wheels,
) -> ([f64; 3], bool) {
    let turn = |off: f64| {
        let brakes = (wheels.turn_acceleration * off.abs()).sqrt();
        let limit = c.turn_speed.si().min(brakes);
        (off * c.gain.si()).clamp(-limit, limit)
    };
    let (distance, yaw) = (goal.distance(robot), robot.base_pose[2]);
    if tolerance.meets(distance, 0.0) {
        let off = math::wrap_angle(goal.yaw - yaw);
        let reached = tolerance.meets(distance, off);
        return ([0.0, 0.0, if reached { 0.0 } else { turn(off) }], reached);
    }
    let (course, speed) = match tree {
        Some(tree) => way_around(robot, goal, tree, c),
        None => straight(robot, goal, c),
    };
    let (off, sense) = sensed(math::wrap_angle(course - yaw));
    // Full speed along the way, hardly any across it.
    let aligned = math::cos(off).max(0.0);
    let cube = aligned * aligned * aligned;
    let speed = speed.min((wheels.acceleration * distance).sqrt());
    ([speed * sense * cube * cube, 0.0, turn(off)], false)
}

/// Course \[rad\] in odom and speed [m/s] on the straight way to a goal.
fn straight(robot: &RobotState, goal: &BaseGoal, c: &DriveConfig) -> (f64, f64) {
    let [x, y, _] = robot.base_pose;
    let course = math::atan2(goal.y - y, goal.x - x);
    (course, c.speed.si().min(c.gain.si() * goal.distance(robot)))
}

/// Course \[rad\] in odom and speed [m/s] on the shortest way to a goal around a disc about the trunk, whose radius is a share of that of the orbit or, if
/// less, of the goal's distance from the trunk. From inside the disc the way leads around and out. The course is continuous wherever the goal is not
/// straight behind the trunk: the tangent to the disc becomes the straight way as the goal comes into view.
fn way_around(robot: &RobotState, goal: &BaseGoal, tree: &Vec3, c: &DriveConfig) -> (f64, f64) {
    let here = (robot.p_odom() - tree).xy();
    let there = nalgebra::Vector2::new(goal.x - tree.x, goal.y - tree.y);
    let way = there - here;
    let disc = c.orbit_share.si() * c.orbit_radius.si().min(there.norm());
    let along = (-here.dot(&way) / way.norm_squared().max(f64::EPSILON)).clamp(0.0, 1.0);
    // On a way that leads outwards nothing comes nearer.
    if along == 0.0 || (here + way * along).norm() >= disc {
        return straight(robot, goal, c);
    }
    let bearing = math::atan2(here.y, here.x);
    let swing = math::wrap_angle(math::atan2(there.y, there.x) - bearing);
    let radius = here.norm();
    let lean = match radius >= disc {
        true => math::asin(disc / radius),
        false => FRAC_PI_2 + math::atan2(c.gain.si() * (disc - radius), 1.0),
    };
    let inward = bearing + PI;
    (if swing < 0.0 { inward + lean } else { inward - lean }, c.speed.si())
}

/// Turn to a course \[rad\] from the heading, and 1 if it is driven forwards or -1 if backwards, where that takes the smaller turn.
fn sensed(course: f64) -> (f64, f64) {
    match course.abs() <= FRAC_PI_2 {
        true => (course, 1.0),
        false => (math::wrap_angle(course + PI), -1.0),
    }
}

#[cfg(test)]
#[path = "mobility_tests.rs"]
mod tests;
