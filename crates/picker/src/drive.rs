//! Driving of the base to a pose beside the tree, around the trunk.

use crate::config::DriveConfig;
use crate::robot_state::RobotState;
use nalgebra::Vector2;
use orchard_geometry::{Pose, Rotation, Vec3, math};
use orchard_quantity::Quantity;

/// A pose of the base, odom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BaseGoal {
    pub x: f64,
    pub y: f64,
    pub yaw: f64,
}

impl BaseGoal {
    /// Makes the pose that faces `centre` from a distance \[m\] and bearing \[rad\] of the base as seen from `centre`.
    pub fn facing(centre: &Vec3, bearing: f64, distance: f64) -> Self {
        let (sin, cos) = math::sin_cos(bearing);
        let yaw = math::wrap_angle(bearing + std::f64::consts::PI);
        Self { x: centre.x + distance * cos, y: centre.y + distance * sin, yaw }
    }

    /// Returns the pose in the odom frame at a height \[m\].
    pub fn pose(&self, height: f64) -> Pose {
        let turn = Rotation::from_axis_angle(&Vec3::z_axis(), self.yaw);
        Pose::from_parts(Vec3::new(self.x, self.y, height).into(), turn)
    }

    /// Distance of the base from the goal \[m\].
    pub fn distance(&self, robot: &RobotState) -> f64 {
        orchard_geometry::math::hypot(self.x - robot.base_pose[0], self.y - robot.base_pose[1])
    }

    fn p(&self) -> Vector2<f64> {
        Vector2::new(self.x, self.y)
    }
}

/// Bearing of `p` as seen from `centre` \[rad\].
pub(crate) fn bearing_of(p: &Vec3, centre: &Vec3) -> f64 {
    math::atan2(p.y - centre.y, p.x - centre.x)
}

/// Tolerance within which a goal counts as reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tolerance {
    position: f64,
    angle: f64,
}

impl Tolerance {
    pub fn new(position: &Quantity, angle: &Quantity) -> Self {
        Self { position: position.si(), angle: angle.si() }
    }

    /// True if a distance \[m\] and an angle \[rad\] are within the tolerance.
    pub fn meets(self, distance: f64, angle: f64) -> bool {
        distance <= self.position && angle.abs() <= self.angle
    }
}

/// Returns the velocity towards a goal in the base frame [m/s, m/s, rad/s], and true if the goal is reached.
///
/// If the goal's bearing about the tree is near the present one, or without a tree, the base drives straight; else it first backs out to the orbit radius and
/// follows that circle.
pub(crate) fn drive(
    robot: &RobotState,
    goal: &BaseGoal,
    tree: Option<&Vec3>,
    c: &DriveConfig,
    tolerance: Tolerance,
) -> ([f64; 3], bool) {
    let here = Vector2::new(robot.base_pose[0], robot.base_pose[1]);
    let yaw = robot.base_pose[2];
    let to_goal = goal.p() - here;
    let turn_left = math::wrap_angle(goal.yaw - yaw);
    if tolerance.meets(to_goal.norm(), turn_left) {
        return ([0.0; 3], true);
    }
    let Some(tree) = tree else {
        let wanted = (to_goal * c.gain.si()).cap_magnitude(c.speed.si());
        return (in_base(&wanted, turn_left, yaw, c), false);
    };
    let outward = here - tree.xy();
    let radius = outward.norm().max(f64::EPSILON);
    let bearing = math::atan2(outward.y, outward.x);
    let goal_out = goal.p() - tree.xy();
    let swing = math::wrap_angle(math::atan2(goal_out.y, goal_out.x) - bearing);
    let along = Vector2::new(-outward.y, outward.x) / radius;
    let out = outward / radius;
    let (orbit, gain) = (c.orbit_radius.si(), c.gain.si());
    let mut wanted = if swing.abs() <= c.orbit_angle.si() {
        to_goal * gain
    } else {
        let held_out = (orbit - radius) * gain;
        // Near the canopy the base first backs out, then goes around.
        let around = if radius > orbit * c.orbit_share.si() { swing * radius * gain } else { 0.0 };
        out * held_out + along * around
    };
    wanted = wanted.cap_magnitude(c.speed.si());
    let clearance = radius - c.trunk_clearance.si();
    let inward = -wanted.dot(&out);
    if inward > clearance.max(0.0) * gain {
        wanted += out * (inward - clearance.max(0.0) * gain);
    }
    let facing = if swing.abs() <= c.orbit_angle.si() {
        turn_left
    } else {
        math::wrap_angle(bearing + std::f64::consts::PI - yaw)
    };
    (in_base(&wanted, facing, yaw, c), false)
}

/// A velocity (odom) in the frame of a base with a yaw, and the turn rate for the rest of a turn \[rad\].
fn in_base(wanted: &Vector2<f64>, turn_left: f64, yaw: f64, c: &DriveConfig) -> [f64; 3] {
    let turn = (turn_left * c.gain.si()).clamp(-c.turn_speed.si(), c.turn_speed.si());
    let (sin, cos) = math::sin_cos(yaw);
    let forward = cos * wanted.x + sin * wanted.y;
    let left = -sin * wanted.x + cos * wanted.y;
    [forward, left, turn]
}

/// Detects a base that is commanded to move and does not.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct StallWatch {
    since: f64,
}

impl StallWatch {
    /// True once the base has been held for `patience` \[s\].
    pub fn is_stalled(
        &mut self,
        robot: &RobotState,
        command: &[f64; 3],
        c: &DriveConfig,
        patience: f64,
    ) -> bool {
        let asked = math::hypot(command[0], command[1]);
        let held = asked > c.stall_command.si() && robot.base_speed < c.stall_speed.si();
        self.since = if held { self.since + robot.dt } else { 0.0 };
        self.since >= patience
    }
}
