//! Looking for fruit: survey postures, then further bearings around the believed tree.

use crate::choose::Choice;
use crate::drive::{BaseGoal, StallWatch, Tolerance, bearing_of, drive};
use crate::rig::{Rig, STILL};
use crate::robot_state::RobotState;
use orchard_geometry::{Vec3, math};

/// Memory of the scan state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scan {
    place: Place,
    posture: usize,
    /// Time in this posture at this place [s].
    dwelled: f64,
    stall: StallWatch,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    /// Where the last attempt ended.
    Here,
    /// At a bearing from the tree; `None` is the present one.
    View(Option<f64>),
    /// On the way to a view.
    Going(BaseGoal),
    /// At a view.
    There(BaseGoal),
}

impl Scan {
    /// At the start of the episode the tree is too far to see fruit.
    pub fn at_start() -> Self {
        Self { place: Place::View(None), posture: 0, dwelled: 0.0, stall: StallWatch::default() }
    }

    /// After an attempt, from where it ended.
    pub fn here() -> Self {
        Self { place: Place::Here, posture: 0, dwelled: 0.0, stall: StallWatch::default() }
    }
}

impl Rig {
    /// One frame of looking around: the base's velocity, and a target once one is found.
    pub fn look_around(&mut self, scan: &mut Scan, robot: &RobotState) -> ([f64; 3], Option<Choice>) {
        let c = self.config.scan.clone();
        let posture = self.postures.survey[scan.posture];
        if self.motion.is_over() && *self.motion.goal() != posture {
            let scale = if self.eyes.blind { c.blind_speed_scale.si() } else { 1.0 };
            self.motion.go(posture, &self.config.arm, scale);
        }
        let tree = self.eyes.belief.p_odom();
        if let Place::View(bearing) = scan.place {
            let bearing = bearing.unwrap_or_else(|| bearing_of(&robot.p_odom(), &tree));
            scan.place = Place::Going(BaseGoal::facing(&tree, bearing, c.standoff.si()));
        }
        let mut velocity = STILL;
        // Without sight nothing moves but the arm.
        if let (Place::Going(goal), false) = (scan.place, self.eyes.blind) {
            let tolerance = Tolerance::new(&c.position_tolerance, &c.angle_tolerance);
            let (towards, arrived) = drive(robot, &goal, &tree, &self.config.drive, tolerance);
            velocity = towards;
            if arrived || scan.stall.is_stalled(robot, &velocity, &self.config.drive, self.patience()) {
                scan.place = Place::There(goal);
                velocity = STILL;
            }
        }
        let arrived = self.eyes.blind || !matches!(scan.place, Place::Going(_));
        if !(arrived && (self.arm_arrived(robot) || self.arm_stalled())) {
            return (velocity, None);
        }
        scan.dwelled += robot.dt;
        if scan.dwelled < c.dwell.si() || !self.fresh_image {
            return (velocity, None);
        }
        let choice = if self.eyes.blind { None } else { self.choose(robot) };
        if choice.is_none() {
            self.look_elsewhere(scan);
        }
        (velocity, choice)
    }

    fn look_elsewhere(&self, scan: &mut Scan) {
        scan.dwelled = 0.0;
        scan.posture += 1;
        if scan.posture < self.postures.survey.len() && scan.place != Place::Here {
            return;
        }
        scan.posture = 0;
        scan.place = match scan.place {
            Place::There(goal) => {
                let p_goal = Vec3::new(goal.x, goal.y, 0.0);
                let bearing = bearing_of(&p_goal, &self.eyes.belief.p_odom());
                Place::View(Some(math::wrap_angle(bearing + self.config.scan.orbit_step.si())))
            }
            Place::Here => Place::View(None),
            on_the_way => on_the_way,
        };
    }
}
