//! Scan: looks for fruit from survey postures, then from further bearings around the believed tree.

use crate::choose::Choice;
use crate::drive::{BaseGoal, StallWatch, Tolerance, bearing_of};
use crate::picker_core::{PickerCore, STILL};
use crate::robot_state::RobotState;
use orchard_geometry::{Vec3, math};
use std::f64::consts::TAU;

/// Memory of the scan state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scan {
    place: Place,
    posture: usize,
    /// Time in this posture at this place \[s\].
    dwelled: f64,
    stall: StallWatch,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    /// At the place where the last attempt ended.
    Here,
    /// To be driven to: a view at a bearing from the tree \[rad\]; `None` is the present bearing.
    View(Option<f64>),
    /// Driving to a view.
    Going(BaseGoal),
    /// At a view.
    There(BaseGoal),
}

impl Scan {
    /// Makes the memory for the start of an episode, where the tree is too far away to see fruit.
    pub fn at_start() -> Self {
        Self { place: Place::View(None), posture: 0, dwelled: 0.0, stall: StallWatch::default() }
    }

    /// Makes the memory for a scan from the present place, after an attempt.
    pub fn here() -> Self {
        Self { place: Place::Here, posture: 0, dwelled: 0.0, stall: StallWatch::default() }
    }
}

impl PickerCore {
    /// Runs one frame of looking around. Returns the base's velocity [m/s, m/s, rad/s] and, once found, a choice of target.
    pub fn look_around(&mut self, scan: &mut Scan, robot: &RobotState) -> ([f64; 3], Option<Choice>) {
        let c = self.config.scan.clone();
        let posture = self.postures.survey[scan.posture];
        if self.motion.is_over() && *self.motion.goal() != posture {
            let scale = if self.perception.blind { c.blind_speed_scale.si() } else { 1.0 };
            self.motion.go(posture, &self.config.arm, scale);
        }
        let tree = self.perception.belief.p_odom();
        if let Some(turn_speed) = self.turn_to_belief(robot, &tree) {
            return ([0.0, 0.0, turn_speed], None);
        }
        if let Place::View(bearing) = scan.place {
            let bearing = bearing.unwrap_or_else(|| bearing_of(&robot.p_odom(), &tree));
            let wanted = BaseGoal::facing(&tree, bearing, c.standoff.si());
            scan.place = Place::Going(self.mobility.nearest(robot, &wanted));
        }
        let mut velocity = STILL;
        // Without sight nothing moves but the arm.
        if let (Place::Going(goal), false) = (scan.place, self.perception.blind) {
            let tolerance = Tolerance::new(&c.position_tolerance, &c.angle_tolerance);
            let (towards, arrived) =
                self.mobility.towards(robot, &goal, &tree, &self.config.drive, tolerance);
            velocity = towards;
            let held = scan.stall.is_stalled(robot, &velocity, &self.config.drive, self.patience());
            if held {
                self.meet_wall(robot);
            }
            if arrived || held {
                scan.place = Place::There(goal);
                velocity = STILL;
            }
        }
        let arrived = self.perception.blind || !matches!(scan.place, Place::Going(_));
        if !(arrived && (self.arm_arrived(robot) || self.arm_stalled())) {
            return (velocity, None);
        }
        scan.dwelled += robot.dt;
        if scan.dwelled < c.dwell.si() || !self.fresh_image {
            return (velocity, None);
        }
        let choice = if self.perception.blind { None } else { self.choose(robot) };
        if choice.is_none() {
            self.look_elsewhere(scan, robot);
        }
        (velocity, choice)
    }

    /// Turn rate [rad/s] towards the believed tree while the canopy is out of view; `None` if the canopy is in view, the base
    /// faces the believed tree, or the config has no such rule.
    fn turn_to_belief(&self, robot: &RobotState, p_tree_odom: &Vec3) -> Option<f64> {
        let c = &self.config.scan;
        if !self.mobility.is_free() || self.perception.canopy_share? >= c.canopy_share_min.si() {
            return None;
        }
        let left = math::wrap_angle(bearing_of(p_tree_odom, &robot.p_odom()) - robot.base_pose[2]);
        let drive = &self.config.drive;
        let limit = drive.turn_speed.si();
        (left.abs() > c.angle_tolerance.si()).then(|| (left * drive.gain.si()).clamp(-limit, limit))
    }

    /// Bearing of the next view around the tree that no wall bars \[rad\]; the present one if all are barred.
    fn next_bearing(&self, bearing: f64, robot: &RobotState) -> f64 {
        let (tree, c) = (self.perception.belief.p_odom(), &self.config.scan);
        let views = (TAU / c.orbit_step.si()).floor() as u32;
        let further = (1..=views).map(|k| math::wrap_angle(bearing + f64::from(k) * c.orbit_step.si()));
        let is_open = |b: &f64| !self.is_barred(robot, &BaseGoal::facing(&tree, *b, c.standoff.si()));
        further.into_iter().find(is_open).unwrap_or(bearing)
    }

    fn look_elsewhere(&self, scan: &mut Scan, robot: &RobotState) {
        scan.dwelled = 0.0;
        scan.posture += 1;
        if scan.posture < self.postures.survey.len() && scan.place != Place::Here {
            return;
        }
        scan.posture = 0;
        scan.place = match scan.place {
            Place::There(goal) => {
                let p_goal = Vec3::new(goal.x, goal.y, 0.0);
                let bearing = bearing_of(&p_goal, &self.perception.belief.p_odom());
                Place::View(Some(self.next_bearing(bearing, robot)))
            }
            Place::Here => Place::View(None),
            on_the_way => on_the_way,
        };
    }
}
