//! Choice of the target fruit, the place of the base and the approach, by cost.

use crate::cloud::SeenPoint;
use crate::drive::{BaseGoal, Tolerance, bearing_of};
use crate::picker_core::PickerCore;
use crate::plan::{GraspPlan, Search, Target};
use crate::robot_state::RobotState;
use orchard_geometry::{Vec3, inverse_transform};
use orchard_perception::Track;

/// A target with the place of the base and the grasp plan for it.
#[derive(Debug, Clone)]
pub(crate) struct Choice {
    pub track: u32,
    pub target: Target,
    pub goal: BaseGoal,
    pub plan: GraspPlan,
    cost: f64,
}

impl PickerCore {
    /// Returns the choice of least cost among the nearest eligible tracks: nearest to the base where it can drive to any of them, else to the
    /// arm, which reaches only some of them.
    pub fn choose(&self, robot: &RobotState) -> Option<Choice> {
        if let Some(task) = &self.task {
            return self.place_for(&task.track(robot.time), robot, f64::INFINITY);
        }
        let is_free = self.mobility.is_free();
        let eligible = self.perception.tracker.confirmed().filter(|t| self.is_eligible(t, robot));
        let mut tracks: Vec<(f64, Track)> = match is_free {
            true => {
                let drive_cost = self.config.align.drive_cost.si();
                eligible.map(|t| (drive_cost * self.least_drive(robot, t) + self.doubt(t), *t)).collect()
            }
            false => eligible.filter_map(|t| Some((self.least_reach(robot, t)?, *t))).collect(),
        };
        tracks.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.id.cmp(&b.1.id)));
        let candidates = self.config.align.candidates.get() as usize;
        if !is_free {
            let choices = tracks.iter().filter_map(|(_, t)| self.place_for(t, robot, f64::INFINITY));
            return choices
                .take(candidates)
                .min_by(|a, b| a.cost.total_cmp(&b.cost).then(a.track.cmp(&b.track)));
        }
        tracks.iter().take(candidates).fold(None, |best: Option<Choice>, (_, track)| {
            self.place_for(track, robot, cost_of(&best)).or(best)
        })
    }

    fn is_eligible(&self, track: &Track, robot: &RobotState) -> bool {
        let height = track.p_odom.z - robot.x_odom_base.translation.z;
        let grasp = &self.config.grasp;
        // A cup has no gap that a fruit must fit in.
        let fits = self.arm.cup().is_some() || track.radius + grasp.clearance.si() <= grasp.opening.si();
        fits && self.config.scan.height.contains_si(height)
            && !self.blacklist.contains(&track.p_odom, robot.time)
    }

    /// Cost of the chance that a track is no fruit, so that its attempt is in vain.
    fn doubt(&self, track: &Track) -> f64 {
        (1.0 - track.score) * self.config.align.doubt_cost.si()
    }

    fn nominal_standoff(&self) -> f64 {
        self.config.align.standoffs.first().map_or(0.0, |s| s.si())
    }

    /// Bearings of the base, as seen from a track, from which its choice starts \[rad\]: straight outwards from the trunk and, where the tree stands in a row, straight out of the row
    /// too, since the bearing from the trunk leads along the row where the canopy is a wall.
    fn fronts(&self, track: &Track, robot: &RobotState) -> Vec<f64> {
        let tree = self.perception.belief.p_odom();
        if let Some(push) = self.task.as_ref().and_then(|task| task.push.as_ref()) {
            return vec![push.heading_odom + std::f64::consts::PI];
        }
        let row = self.walls.row(&tree, &self.config);
        let across = row.map(|row| row.outwards(&robot.p_odom().xy()));
        [bearing_of(&track.p_odom, &tree)].into_iter().chain(across).collect()
    }

    /// Length of the drive, around the tree \[m\].
    fn drive_cost(&self, robot: &RobotState, goal: &BaseGoal) -> f64 {
        let (tree, align) = (self.perception.belief.p_odom(), &self.config.align);
        let tolerance = Tolerance::new(&align.position_tolerance, &align.angle_tolerance);
        self.mobility.effort(robot, goal, &tree, &self.config.drive, tolerance)
    }

    /// Length of the shortest drive to a place for a track, before the arm is asked \[m\]; without an end where walls bar all ways.
    fn least_drive(&self, robot: &RobotState, track: &Track) -> f64 {
        let standoff = self.nominal_standoff();
        let fronts = self.fronts(track, robot).into_iter();
        let fronts = fronts.map(|bearing| BaseGoal::facing(&track.p_odom, bearing, standoff));
        let goals = self.straight_ahead(robot, track).into_iter().chain(fronts);
        let open = goals.filter(|goal| !self.is_barred(robot, goal));
        open.map(|goal| self.drive_cost(robot, &goal)).fold(f64::INFINITY, f64::min)
    }

    /// Shortest way to a track for a base that cannot leave its spot or its rail \[m\]: its drive and then the way from the arm's first joint;
    /// `None` if the track is beyond the arm's length.
    fn least_reach(&self, robot: &RobotState, track: &Track) -> Option<f64> {
        let goal = self.nearest_goal(robot, track);
        let p_there = inverse_transform(&goal.pose(robot.x_odom_base.translation.z), &track.p_odom);
        let way = (p_there - self.arm.shoulder()).norm();
        self.arm.may_reach(&p_there).then(|| self.drive_cost(robot, &goal) + way)
    }

    /// Place for a track of a base that cannot leave its spot or its rail.
    fn nearest_goal(&self, robot: &RobotState, track: &Track) -> BaseGoal {
        self.mobility.nearest(robot, &BaseGoal::facing(&track.p_odom, 0.0, 0.0))
    }

    /// Places for a track that a base on wheels takes without a turn.
    fn straight_ahead(&self, robot: &RobotState, track: &Track) -> Vec<BaseGoal> {
        // A push comes from a given side.
        if self.task.as_ref().is_some_and(|task| task.push.is_some()) {
            return Vec::new();
        }
        let standoffs: Vec<f64> = self.config.align.standoffs.iter().map(|s| s.si()).collect();
        self.mobility.straight_ahead(robot, &track.p_odom, &standoffs)
    }

    /// Returns the best place from which the arm can grasp a track, if it costs less than a limit: one before one of its fronts, or for wheels one straight ahead.
    fn place_for(&self, track: &Track, robot: &RobotState, limit: f64) -> Option<Choice> {
        let points: Vec<SeenPoint> = self.perception.points().collect();
        if !self.mobility.is_free() {
            return self.choice_at(track, robot, self.nearest_goal(robot, track), &points, limit);
        }
        let mut best = None;
        for front in self.fronts(track, robot) {
            best = self.place_before(track, robot, front, &points, cost_of(&best).min(limit)).or(best);
        }
        for goal in self.straight_ahead(robot, track) {
            best = self.choice_at(track, robot, goal, &points, cost_of(&best).min(limit)).or(best);
        }
        best
    }

    /// Best place about a track whose bearing is that of a front \[rad\], with the best stand-off there, or is turned from it by one of the angles of the config; if it costs less than a limit.
    /// The arm's reach depends on distance and height alone.
    fn place_before(
        &self,
        track: &Track,
        robot: &RobotState,
        front: f64,
        points: &[SeenPoint],
        limit: f64,
    ) -> Option<Choice> {
        let align = &self.config.align;
        let at = |turn: f64, standoff: f64, limit: f64| {
            let goal = BaseGoal::facing(&track.p_odom, front + turn, standoff);
            self.choice_at(track, robot, goal, points, limit)
        };
        let (mut standoff, mut straight) = (0.0, None);
        for distance in &align.standoffs {
            if let Some(choice) = at(0.0, distance.si(), cost_of(&straight)) {
                (standoff, straight) = (distance.si(), Some(choice));
            }
        }
        let mut best = Some(straight?);
        for turn in &align.bearings {
            best = at(turn.si(), standoff, cost_of(&best).min(limit)).or(best);
        }
        best.filter(|choice| choice.cost < limit)
    }

    /// Returns the best grasp of a track from one place of the base, if it costs less than a limit.
    fn choice_at(
        &self,
        track: &Track,
        robot: &RobotState,
        goal: BaseGoal,
        points: &[SeenPoint],
        limit: f64,
    ) -> Option<Choice> {
        let tree = self.perception.belief.p_odom();
        let from_trunk = (Vec3::new(goal.x, goal.y, 0.0) - tree).xy().norm();
        if self.mobility.is_free() && from_trunk < self.config.drive.trunk_clearance.si() {
            return None;
        }
        if self.is_barred(robot, &goal) {
            return None;
        }
        let c = &self.config.align;
        let drive = self.drive_cost(robot, &goal) * c.drive_cost.si();
        let doubt = self.doubt(track);
        let there = goal.pose(robot.x_odom_base.translation.z);
        let seen: Vec<SeenPoint> = points.iter().map(|point| point.within(&there)).collect();
        let crowd = seen.iter().filter(|point| self.is_crowding(&point.p)).count() as f64 * c.crowd_cost.si();
        let target = Target { p: track.p_odom, radius: track.radius };
        let target_there = Target { p: inverse_transform(&there, &track.p_odom), radius: track.radius };
        let search = Search {
            arm: &self.arm,
            config: &self.config,
            target: &target_there,
            points: &seen,
            others: &self.others(track.id, &target, &there),
            refused: &self.blacklist.refused(&track.p_odom, &there),
            q_start: &self.postures.carry(),
            reach_margin: self.config.approach.reach_margin.si(),
        };
        let plan = search.cheaper_than(limit - drive - crowd - doubt)?;
        let cost = drive + plan.cost + crowd + doubt;
        (cost < limit).then_some(Choice { track: track.id, target, goal, plan, cost })
    }

    /// True if a point lies in the volume of chassis and arm.
    fn is_crowding(&self, p_base: &Vec3) -> bool {
        let c = &self.config.align;
        p_base.x.abs() <= c.body_half_x.si()
            && p_base.y.abs() <= c.body_half_y.si()
            && p_base.z <= c.body_height.si()
    }
}

/// Cost of the best choice so far; without an end if there is none.
fn cost_of(best: &Option<Choice>) -> f64 {
    best.as_ref().map_or(f64::INFINITY, |choice| choice.cost)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PickerConfig;
    use crate::expert::ExpertConfig;
    use crate::record::State;
    use orchard_perception::DetectorConfig;
    use orchard_robot::RobotModel;

    /// A fruit that hangs in a row, along it from the trunk, is taken from before the row, on the robot's side; the place straight outwards is behind the wires.
    #[test]
    fn a_fruit_along_the_row_is_taken_from_before_it() {
        let robot = RobotModel::paper();
        let config = ExpertConfig::preset().shared;
        let mut core = PickerCore::new(&robot, DetectorConfig::paper(), config, State::Scan);
        let x = core.perception.belief.p_odom().x;
        for z in [0.6, 1.0] {
            let wire: Vec<Vec3> = (0..=30).map(|k| Vec3::new(x, 0.2 * f64::from(k) - 3.0, z)).collect();
            for y in [0.0, 0.5] {
                core.walls.see(wire.clone(), Vec3::new(0.4, y, 1.0), &core.config.wires);
            }
        }
        let p_odom = Vec3::new(x + 0.05, 1.4, 0.9);
        let track =
            Track { id: 0, p_odom, radius: 0.03, score: 1.0, hits: 9, last_seen: 0.0, confirmed: true };
        let choice = core.place_for(&track, &RobotState::still(0.0), f64::INFINITY).expect("a place");
        assert!(choice.goal.x < x - 0.5, "{:?}", choice.goal);
    }

    /// The expert leaves fruit that do not fit between its open fingers; a cup and the baseline try any.
    #[test]
    fn fruit_wider_than_the_hand_are_left() {
        let takes = |robot: &str, config: &PickerConfig, radius: f64| {
            let robot = RobotModel::named(robot).expect("built in");
            let config = config.tuned(&robot).expect("in range");
            let p_odom = Vec3::new(1.0, 0.0, 1.0);
            let core = PickerCore::new(&robot, DetectorConfig::paper(), config, State::Scan);
            let track = Track { id: 0, p_odom, radius, score: 1.0, hits: 9, last_seen: 0.0, confirmed: true };
            core.is_eligible(&track, &RobotState::still(0.0))
        };
        let (expert, baseline) = (ExpertConfig::preset().shared, PickerConfig::baseline());
        let widest = expert.grasp.opening.si() - expert.grasp.clearance.si();
        assert!(takes("ridgeback-fr3", &expert, widest - 1e-4));
        assert!(!takes("ridgeback-fr3", &expert, widest + 1e-4));
        assert!(takes("ridgeback-fr3", &baseline, 0.05));
        assert!(takes("rail-xarm6-suction", &expert, 0.05));
    }
}
