//! Scan: looks for fruit from survey postures, then from further bearings around the believed tree.

use crate::choose::Choice;
use crate::drive::{BaseGoal, StallWatch, Tolerance, bearing_of};
use crate::picker_core::{PickerCore, STILL};
use crate::robot_state::RobotState;
use crate::row::{Round, Side};
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
        Self::of(Place::View(None))
    }

    /// Makes the memory for a scan from the present place, after an attempt.
    pub fn here() -> Self {
        Self::of(Place::Here)
    }

    /// Makes the memory for a scan that begins with a drive to a view which no contact has ended.
    pub fn elsewhere() -> Self {
        Self::of(Place::View(None))
    }

    fn of(place: Place) -> Self {
        Self { place, posture: 0, dwelled: 0.0, stall: StallWatch::default() }
    }
}

impl PickerCore {
    /// Runs one frame of looking around. Returns the base's velocity [m/s, m/s, rad/s] and, once found, a choice of target.
    pub fn look_around(&mut self, scan: &mut Scan, robot: &RobotState) -> ([f64; 3], Option<Choice>) {
        let c = self.config.scan.clone();
        let posture = self.postures.survey[scan.posture];
        // Before the first image it is not known whether the camera sees.
        if self.perception.images > 0 && self.motion.is_over() && *self.motion.goal() != posture {
            let scale = if self.perception.blind { c.blind_speed_scale.si() } else { 1.0 };
            self.motion.go(posture, &self.config.arm, scale);
        }
        if let Some(round) = self.side.way {
            return (self.go_round(round, scan, robot), None);
        }
        let tree = self.perception.belief.p_odom();
        if let Some(turn_speed) = self.turn_to_belief(robot, &tree) {
            return ([0.0, 0.0, turn_speed], None);
        }
        if let Place::View(bearing) = scan.place {
            let bearing = bearing.unwrap_or_else(|| self.first_bearing(robot));
            let wanted = BaseGoal::facing(&tree, bearing, c.standoff.si());
            scan.place = Place::Going(self.mobility.nearest(robot, &wanted));
        }
        let mut velocity = STILL;
        // Without sight nothing moves but the arm.
        if let (Place::Going(goal), false) = (scan.place, self.perception.blind) {
            let tolerance = Tolerance::new(&c.position_tolerance, &c.angle_tolerance);
            let (towards, arrived) =
                self.mobility.towards(robot, &goal, Some(&tree), &self.config.drive, tolerance);
            velocity = towards;
            let held = scan.stall.is_stalled(robot, &velocity, &self.config.drive, self.patience());
            if held {
                self.meet_wall(robot);
            }
            if arrived || held {
                (scan.place, scan.stall) = (Place::There(goal), StallWatch::default());
                velocity = STILL;
            }
        }
        let arrived = self.perception.blind || !matches!(scan.place, Place::Going(_));
        if !(arrived && self.arm_settled(robot)) {
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

    /// Bearing of the first view \[rad\]: the present bearing, or the next one if a contact has ended the view there.
    fn first_bearing(&self, robot: &RobotState) -> f64 {
        let present = bearing_of(&robot.p_odom(), &self.perception.belief.p_odom());
        if self.is_among(present, &self.side.barred) { self.next_bearing(present, robot) } else { present }
    }

    /// Bearing of the next view around the tree that neither a wall nor a contact bars \[rad\]; the present one if all are barred.
    fn next_bearing(&self, bearing: f64, robot: &RobotState) -> f64 {
        let (tree, c) = (self.perception.belief.p_odom(), &self.config.scan);
        let views = (TAU / c.orbit_step.si()).floor() as u32;
        let further = (1..=views).map(|k| math::wrap_angle(bearing + f64::from(k) * c.orbit_step.si()));
        let is_open = |b: &f64| {
            !self.is_among(*b, &self.side.barred)
                && !self.is_barred(robot, &BaseGoal::facing(&tree, *b, c.standoff.si()))
        };
        further.into_iter().find(is_open).unwrap_or(bearing)
    }

    /// True if a bearing is the same view as one of others.
    fn is_among(&self, bearing: f64, others: &[f64]) -> bool {
        let again = 0.5 * self.config.scan.orbit_step.si();
        others.iter().any(|b| math::wrap_angle(bearing - b).abs() < again)
    }

    /// Drives on along a way round the end of a row; at its end, views of the tree begin. If something holds the base, or the row
    /// leads too far, it turns back. Returns the base's velocity
    /// [m/s, m/s, rad/s].
    fn go_round(&mut self, mut round: Round, scan: &mut Scan, robot: &RobotState) -> [f64; 3] {
        let (tree, c) = (self.perception.belief.p_odom(), &self.config);
        let tolerance = &c.scan.position_tolerance;
        let corner = self.walls.row(&tree, c).and_then(|row| {
            row.corner(&robot.p_odom().xy(), &mut round, c.drive.row_clearance.si(), tolerance.si())
        });
        let Some(corner) = corner else {
            (self.side, *scan) = (Side::at(robot.p_odom().xy()), Scan::at_start());
            return STILL;
        };
        self.side.way = Some(round);
        if self.perception.blind {
            return STILL;
        }
        let tolerance = Tolerance::new(tolerance, &c.scan.angle_tolerance);
        let (velocity, _) = self.mobility.towards(robot, &corner, None, &c.drive, tolerance);
        let off_tree = (robot.p_odom() - tree).xy().norm();
        let strays = off_tree > c.drive.row_far.si() && round.back().is_some();
        if strays || scan.stall.is_stalled(robot, &velocity, &c.drive, self.patience()) {
            self.turn_back(robot);
            *scan = Scan::at_start();
        }
        velocity
    }

    /// Takes note that something presses on the arm while the robot looks around. The view, or the view it drives to, is barred; on a way round a row it turns back.
    pub fn bar_view(&mut self, scan: &Scan, robot: &RobotState) {
        let p = match (self.side.way, scan.place) {
            (None, Place::Going(goal)) => Vec3::new(goal.x, goal.y, 0.0),
            (None, _) => robot.p_odom(),
            (Some(_), _) => return self.turn_back(robot),
        };
        self.meet_wall(robot);
        let bearing = bearing_of(&p, &self.perception.belief.p_odom());
        self.side.barred.push(bearing);
    }

    /// Takes note that something holds the base on a way round the end of a row: it turns back, and where it did so already it works on from where it is.
    fn turn_back(&mut self, robot: &RobotState) {
        self.meet_wall(robot);
        if let Some(round) = self.side.way.take() {
            let here = Side::at(robot.p_odom().xy());
            self.side = round.back().map_or(here, |back| Side { way: Some(back), ..self.side.clone() });
        }
    }

    /// Begins the way to the other side of a row after failed attempts in a row, unless the base is on one. Returns true if it is on one then.
    pub fn leave_in_vain(&mut self, robot: &RobotState) -> bool {
        if self.side.way.is_none() && self.side.failures >= self.config.drive.row_failures.get() {
            self.side.way = self.way_round(robot);
        }
        self.side.way.is_some()
    }

    /// Way to the other side of the row, if the tree stands in one and the base can drive round it.
    fn way_round(&self, robot: &RobotState) -> Option<Round> {
        let c = &self.config;
        if !self.mobility.is_free() || self.task.is_some() || c.drive.row_clearance.si() <= 0.0 {
            return None;
        }
        let row = self.walls.row(&self.perception.belief.p_odom(), c)?;
        Some(row.round(&robot.p_odom().xy(), &self.side))
    }

    fn look_elsewhere(&mut self, scan: &mut Scan, robot: &RobotState) {
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
                self.side.views.push(bearing);
                let next = self.next_bearing(bearing, robot);
                if self.is_among(next, &self.side.views) {
                    self.side.way = self.way_round(robot);
                }
                Place::View(Some(next))
            }
            Place::Here => Place::View(None),
            on_the_way => on_the_way,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;
    use crate::record::{AttemptEnd, State};
    use orchard_perception::DetectorConfig;
    use orchard_robot::RobotModel;

    const DT: f64 = 1.0 / 60.0;
    /// Half-length of the row, across the robot's start.
    const HALF: f64 = 3.0;

    /// A picker that has tried in vain on its side, before a trellis of two wires through its tree if it has seen them.
    fn core(robot: &str, sees: bool) -> PickerCore {
        let robot = RobotModel::named(robot).expect("built in");
        let config = ExpertConfig::preset().tuned(&robot).expect("in range").shared;
        let mut core = PickerCore::new(&robot, DetectorConfig::paper(), config, State::Scan);
        core.perception.blind = false;
        core.side.failures = core.config.drive.row_failures.get();
        let x = core.perception.belief.p_odom().x;
        for z in [0.6, 1.0].into_iter().filter(|_| sees) {
            let wire = (0..=30).map(|k| Vec3::new(x, HALF * (f64::from(k) / 15.0 - 1.0), z));
            for y in [0.0, 0.5] {
                core.walls.see(wire.clone().collect(), Vec3::new(0.4, y, 1.0), &core.config.wires);
            }
        }
        core
    }

    fn at(time: f64, pose: [f64; 3], velocity: [f64; 3]) -> RobotState {
        let mut robot = RobotState { dt: DT, ..RobotState::still(time) };
        robot.place_base(pose);
        robot.base_speed = math::hypot(velocity[0], velocity[1]);
        robot
    }

    /// A base that drives in any direction and one on wheels get to the other side, facing the tree's row, and keep their distance from it. A base on a rail or a stand has
    /// no such way, nor has one that has seen no wires, or that failed less often.
    #[test]
    fn a_base_drives_round_the_end() {
        for (robot, sees) in [("rail-xarm6-suction", true), ("fr3-fixed", true), ("ridgeback-fr3", false)] {
            assert!(!core(robot, sees).leave_in_vain(&at(0.0, [0.0; 3], STILL)), "{robot}");
        }
        let mut hopeful = core("ridgeback-fr3", true);
        hopeful.side.failures -= 1;
        assert!(!hopeful.leave_in_vain(&at(0.0, [0.0; 3], STILL)));
        for robot in ["ridgeback-fr3", "husky-ur5e-2f85"] {
            let mut core = core(robot, true);
            let (mut pose, mut velocity, mut scan) = ([0.0, 0.2, 0.0], STILL, Scan::here());
            assert!(core.leave_in_vain(&at(0.0, pose, velocity)), "{robot}");
            let (x_row, clearance) =
                (core.perception.belief.p_odom().x, core.config.drive.row_clearance.si());
            let mut frame = 0;
            while core.side.way.is_some() {
                frame += 1;
                assert!(frame < 60 * 60, "{robot} {pose:?}");
                velocity = core.look_around(&mut scan, &at(f64::from(frame) * DT, pose, velocity)).0;
                let (sin, cos) = math::sin_cos(pose[2]);
                pose[0] += DT * (cos * velocity[0] - sin * velocity[1]);
                pose[1] += DT * (sin * velocity[0] + cos * velocity[1]);
                pose[2] += DT * velocity[2];
                let off = math::hypot(pose[0] - x_row, (pose[1].abs() - HALF).max(0.0));
                assert!(off > clearance - 0.3, "{robot} {pose:?}");
            }
            assert!((pose[0] - x_row - clearance).abs() < 0.15 && pose[1].abs() < 0.15, "{robot} {pose:?}");
            assert_eq!(core.side, Side::at(Vec3::new(pose[0], pose[1], 0.0).xy()));
        }
    }

    /// A view that a contact has ended, or the way there, is passed over until a fruit is picked.
    #[test]
    fn a_contact_bars_the_view() {
        let mut core = core("ridgeback-fr3", false);
        let robot = at(0.0, [0.5, 0.0, 0.0], STILL);
        let (present, step) = (core.first_bearing(&robot), core.config.scan.orbit_step.si());
        let steps = |core: &PickerCore| math::wrap_angle(core.first_bearing(&robot) - present) / step;
        core.bar_view(&Scan::here(), &robot);
        assert!((steps(&core) - 1.0).abs() < 1e-9);
        let next = BaseGoal::facing(&core.perception.belief.p_odom(), present + step, 1.0);
        core.bar_view(&Scan::of(Place::Going(next)), &robot);
        assert!((steps(&core) - 2.0).abs() < 1e-9);
        core.side.note(AttemptEnd::Deposited);
        assert_eq!(steps(&core), 0.0);
    }

    /// A base whose row leads too far turns back, though nothing holds it.
    #[test]
    fn a_base_does_not_stray() {
        let mut core = core("ridgeback-fr3", true);
        let (near, mut scan) = ([0.5, 1.0, 0.0], Scan::here());
        assert!(core.leave_in_vain(&at(0.0, near, STILL)));
        let far = [0.5, core.config.drive.row_far.si(), 0.0];
        for (pose, turns) in [(near, false), (far, true)] {
            core.look_around(&mut scan, &at(DT, pose, [0.5, 0.0, 0.0]));
            assert_eq!(core.side.way.map(|way| way.back().is_none()), Some(turns));
        }
    }

    /// A base that something holds on the way turns back; if it is held on the way back too, it works on from there.
    #[test]
    fn a_base_that_is_held_turns_back() {
        let mut core = core("ridgeback-fr3", true);
        let (pose, mut scan) = ([0.5, 1.0, 0.0], Scan::here());
        assert!(core.leave_in_vain(&at(0.0, pose, STILL)));
        let returns = |core: &PickerCore| core.side.way.map(|way| way.back().is_none());
        let frames = (core.patience() / DT) as u32;
        for frame in 0..2 * frames + 4 {
            if frame < frames {
                assert_eq!(returns(&core), Some(false));
            } else if (frames + 2..2 * frames).contains(&frame) {
                // What was in vain before begins no new way.
                assert!(core.leave_in_vain(&at(f64::from(frame) * DT, pose, STILL)));
                assert_eq!(returns(&core), Some(true));
            }
            core.look_around(&mut scan, &at(f64::from(frame) * DT, pose, STILL));
        }
        assert_eq!(core.side, Side::at(Vec3::new(pose[0], pose[1], 0.0).xy()));
    }
}
