//! Scan: look around, go around the believed tree, choose a target.

use crate::baseline::approach::Align;
use crate::baseline::{BaselinePicker, Next, Phase, STILL};
use crate::drive::{BaseGoal, StallWatch, Tolerance, bearing_of, drive};
use crate::plan::{GraspPlan, Target, plan};
use crate::robot_state::RobotState;
use orchard_geometry::{Vec3, inverse_transform, math};
use orchard_perception::Track;

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

/// A target with the place and the posture for it.
struct Choice {
    track: u32,
    target: Target,
    goal: BaseGoal,
    plan: GraspPlan,
    cost: f64,
}

impl BaselinePicker {
    pub(crate) fn scan(&mut self, mut scan: Scan, robot: &RobotState) -> Next {
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
            return Next::Stay(Phase::Scan(scan), velocity);
        }
        scan.dwelled += robot.dt;
        if scan.dwelled < c.dwell.si() || !self.fresh_image {
            return Next::Stay(Phase::Scan(scan), velocity);
        }
        if let Some(next) = self.commit_to_best(robot) {
            return next;
        }
        self.look_elsewhere(&mut scan);
        Next::Stay(Phase::Scan(scan), velocity)
    }

    fn commit_to_best(&mut self, robot: &RobotState) -> Option<Next> {
        if self.eyes.blind {
            return None;
        }
        let choice = self.choose(robot)?;
        self.commit(robot, choice.track, choice.target, choice.plan);
        Some(Next::Enter(Phase::Align(Align::towards(choice.goal))))
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

    /// The cheapest of the nearest eligible tracks.
    fn choose(&self, robot: &RobotState) -> Option<Choice> {
        if let Some(errand) = &self.errand {
            return self.place_for(&errand.track(robot.time), robot);
        }
        let mut tracks: Vec<(f64, Track)> = self
            .eyes
            .tracker
            .confirmed()
            .filter(|t| self.is_eligible(t, robot))
            .map(|t| (self.drive_cost(robot, &self.outward_goal(t, 0.0, self.nominal_standoff())), *t))
            .collect();
        tracks.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.id.cmp(&b.1.id)));
        tracks.truncate(self.config.align.candidates.get() as usize);
        let choices = tracks.iter().filter_map(|(_, t)| self.place_for(t, robot));
        choices.min_by(|a, b| a.cost.total_cmp(&b.cost).then(a.track.cmp(&b.track)))
    }

    fn is_eligible(&self, track: &Track, robot: &RobotState) -> bool {
        let height = track.p_odom.z - robot.x_odom_base.translation.z;
        self.config.scan.height.contains_si(height) && !self.blacklist.contains(&track.p_odom, robot.time)
    }

    fn nominal_standoff(&self) -> f64 {
        self.config.align.standoffs.first().map_or(0.0, |s| s.si())
    }

    /// A place before the track, its bearing turned from straight outwards.
    fn outward_goal(&self, track: &Track, turn: f64, standoff: f64) -> BaseGoal {
        let push = self.errand.as_ref().and_then(|errand| errand.push.as_ref());
        let bearing = match push {
            Some(push) => push.heading_odom + std::f64::consts::PI,
            None => bearing_of(&track.p_odom, &self.eyes.belief.p_odom()),
        };
        BaseGoal::facing(&track.p_odom, bearing + turn, standoff)
    }

    /// Metres of driving, the way round the tree included.
    fn drive_cost(&self, robot: &RobotState, goal: &BaseGoal) -> f64 {
        let tree = self.eyes.belief.p_odom();
        let p_goal = Vec3::new(goal.x, goal.y, 0.0);
        let swing = math::wrap_angle(bearing_of(&p_goal, &tree) - bearing_of(&robot.p_odom(), &tree)).abs();
        (p_goal - robot.p_odom()).norm() + swing * self.config.drive.orbit_radius.si()
    }

    /// The best place from which the arm can grasp a track: the best stand-off straight outwards, then the best
    /// bearing for it. What the arm reaches depends on distance and height alone.
    fn place_for(&self, track: &Track, robot: &RobotState) -> Option<Choice> {
        let align = &self.config.align;
        let points: Vec<Vec3> = self.eyes.points().copied().collect();
        let cheaper = |a: &Choice, b: &Choice| a.cost.total_cmp(&b.cost);
        let outwards = align.standoffs.iter().filter_map(|s| {
            let choice = self.choice_at(track, robot, self.outward_goal(track, 0.0, s.si()), &points)?;
            Some((s.si(), choice))
        });
        let (standoff, straight) = outwards.min_by(|a, b| cheaper(&a.1, &b.1))?;
        let turned = align.bearings.iter().filter_map(|b| {
            self.choice_at(track, robot, self.outward_goal(track, b.si(), standoff), &points)
        });
        turned.chain(std::iter::once(straight)).min_by(cheaper)
    }

    /// The best grasp of a track from one place of the base.
    fn choice_at(
        &self,
        track: &Track,
        robot: &RobotState,
        goal: BaseGoal,
        points: &[Vec3],
    ) -> Option<Choice> {
        let tree = self.eyes.belief.p_odom();
        if (Vec3::new(goal.x, goal.y, 0.0) - tree).xy().norm() < self.config.drive.trunk_clearance.si() {
            return None;
        }
        let there = goal.pose(robot.x_odom_base.translation.z);
        let seen: Vec<Vec3> = points.iter().map(|p| inverse_transform(&there, p)).collect();
        let target_there = Target { p: inverse_transform(&there, &track.p_odom), radius: track.radius };
        let plan = plan(&self.arm, &target_there, &seen, &self.postures.carry(), &self.config)?;
        let crowd = seen.iter().filter(|p| self.is_crowding(p)).count() as f64;
        let c = &self.config.align;
        let cost = self.drive_cost(robot, &goal) * c.drive_cost.si() + plan.cost + crowd * c.crowd_cost.si();
        let target = Target { p: track.p_odom, radius: track.radius };
        Some(Choice { track: track.id, target, goal, plan, cost })
    }

    /// Points where chassis and arm would stand.
    fn is_crowding(&self, p_base: &Vec3) -> bool {
        let c = &self.config.align;
        p_base.x.abs() <= c.body_half_x.si()
            && p_base.y.abs() <= c.body_half_y.si()
            && p_base.z <= c.body_height.si()
    }

    /// Points of the last images in the present base frame.
    pub(crate) fn points_base(&self, robot: &RobotState) -> Vec<Vec3> {
        self.eyes.points().map(|p| inverse_transform(&robot.x_odom_base, p)).collect()
    }
}
