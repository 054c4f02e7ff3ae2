//! Scan: look around, go around the believed tree, choose a target.

use crate::approach::Align;
use crate::baseline::{BaselinePicker, Next, Phase, STILL};
use crate::drive::{BaseGoal, bearing_of, drive};
use crate::eyes::over_deck;
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
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    /// Where the last attempt ended.
    Here,
    /// At a bearing from the tree; `None` is the present one.
    View(Option<f64>),
}

impl Scan {
    /// At the start of the episode the tree is too far to see fruit.
    pub fn at_start() -> Self {
        Self { place: Place::View(None), posture: 0, dwelled: 0.0 }
    }

    /// After an attempt, what has been seen so far is tried first.
    pub fn here() -> Self {
        Self { place: Place::Here, posture: 0, dwelled: 0.0 }
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
        let (mut velocity, mut arrived) = (STILL, true);
        if let Place::View(bearing) = scan.place {
            let bearing = bearing.unwrap_or_else(|| bearing_of(&robot.p_odom(), &tree));
            scan.place = Place::View(Some(bearing));
            let goal = BaseGoal::facing(&tree, bearing, c.standoff.si());
            // Without sight nothing moves but the arm.
            if !self.eyes.blind {
                (velocity, arrived) = drive(robot, &goal, &tree, &self.config.drive);
            }
        }
        if !(arrived && (self.arm_arrived(robot) || self.arm_stalled())) {
            return Next::Stay(Phase::Scan(scan), velocity);
        }
        scan.dwelled += robot.dt;
        if scan.dwelled < c.dwell.si() || !self.fresh_image {
            return Next::Stay(Phase::Scan(scan), velocity);
        }
        if !self.eyes.blind
            && let Some(choice) = self.choose(robot)
        {
            self.commit(robot, choice.track, choice.target, choice.plan);
            return Next::Enter(Phase::Align(Align::towards(choice.goal)));
        }
        self.look_elsewhere(&mut scan);
        Next::Stay(Phase::Scan(scan), velocity)
    }

    fn look_elsewhere(&self, scan: &mut Scan) {
        scan.dwelled = 0.0;
        scan.posture += 1;
        if scan.posture < self.postures.survey.len() && scan.place != Place::Here {
            return;
        }
        scan.posture = 0;
        scan.place = match scan.place {
            Place::View(Some(bearing)) if !self.eyes.blind => {
                Place::View(Some(math::wrap_angle(bearing + self.config.scan.orbit_step.si())))
            }
            Place::View(bearing) => Place::View(bearing),
            Place::Here => Place::View(None),
        };
    }

    /// The cheapest of the nearest eligible tracks.
    fn choose(&self, robot: &RobotState) -> Option<Choice> {
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
        self.config.scan.height.contains_si(height)
            && !self.blacklist.contains(&track.p_odom, robot.time)
            && !over_deck(&track.p_odom, robot, &self.deck())
    }

    /// Half-extents of the deck with the bucket, where a fruit is no longer the tree's.
    fn deck(&self) -> Vec3 {
        let p = self.postures.p_bucket;
        Vec3::new(p.x.abs() + self.config.deposit.centred.si() * 2.0, p.x.abs(), f64::INFINITY)
    }

    fn nominal_standoff(&self) -> f64 {
        self.config.align.standoffs.first().map_or(0.0, |s| s.si())
    }

    /// A place before the track, its bearing turned from straight outwards.
    fn outward_goal(&self, track: &Track, turn: f64, standoff: f64) -> BaseGoal {
        let bearing = bearing_of(&track.p_odom, &self.eyes.belief.p_odom());
        BaseGoal::facing(&track.p_odom, bearing + turn, standoff)
    }

    /// Metres of driving, the way round the tree included.
    fn drive_cost(&self, robot: &RobotState, goal: &BaseGoal) -> f64 {
        let tree = self.eyes.belief.p_odom();
        let p_goal = Vec3::new(goal.x, goal.y, 0.0);
        let swing = math::wrap_angle(bearing_of(&p_goal, &tree) - bearing_of(&robot.p_odom(), &tree)).abs();
        (p_goal - robot.p_odom()).norm() + swing * self.config.drive.orbit_radius.si()
    }

    /// The best place from which the arm can grasp a track.
    fn place_for(&self, track: &Track, robot: &RobotState) -> Option<Choice> {
        let align = &self.config.align;
        let target = Target { p: track.p_odom, radius: track.radius };
        let points: Vec<Vec3> = self.eyes.points().copied().collect();
        let carry = self.postures.carry();
        let mut best: Option<Choice> = None;
        for standoff in &align.standoffs {
            for turn in &align.bearings {
                let goal = self.outward_goal(track, turn.si(), standoff.si());
                let tree = self.eyes.belief.p_odom();
                if (Vec3::new(goal.x, goal.y, 0.0) - tree).xy().norm()
                    < self.config.drive.trunk_clearance.si()
                {
                    continue;
                }
                let there = goal.pose(robot.x_odom_base.translation.z);
                let seen: Vec<Vec3> = points.iter().map(|p| inverse_transform(&there, p)).collect();
                let target_there = Target { p: inverse_transform(&there, &target.p), radius: target.radius };
                // What the arm reaches depends on distance and height alone: no need to try other bearings.
                let Some(plan) = plan(&self.arm, &target_there, &seen, &carry, &self.config) else { break };
                let crowd = seen.iter().filter(|p| self.is_crowding(p)).count() as f64;
                let cost = self.drive_cost(robot, &goal) * align.drive_cost.si()
                    + plan.cost
                    + crowd * align.crowd_cost.si();
                if best.as_ref().is_none_or(|b| cost < b.cost) {
                    best = Some(Choice { track: track.id, target, goal, plan, cost });
                }
            }
            if best.is_some() {
                break;
            }
        }
        best
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
