//! Grasp planning: approach directions that the arm can follow, compared by the seen points in the path of the hand and in the line of
//! sight of the second look, and by the turn of the arm.

use crate::cloud::SeenPoint;
use crate::config::PickerConfig;
use orchard_geometry::{Mat3, Pose, Rotation, Vec3, inverse_transform, math, transform};
use orchard_robot::{ArmKinematics, IkTarget, JointVector};

/// A target fruit; the context gives the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Target {
    pub p: Vec3,
    pub radius: f64,
}

/// Plan of a grasp: orientation of the hand and the posture in which its straight approach begins, base frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GraspPlan {
    /// Orientation of the TCP.
    pub rotation: Rotation,
    /// Posture of the second look.
    pub q_look: JointVector,
    /// Points in the path of the hand, by their weights.
    pub met: f64,
    /// Cost of points in the path and in the line of sight, and of turning, in points.
    pub cost: f64,
}

impl GraspPlan {
    /// Direction of the approach, base frame.
    pub fn direction(&self) -> Vec3 {
        self.rotation * Vec3::z()
    }
}

/// Returns the orientation of a hand that points along a direction with the camera's side up: x in the vertical plane.
pub(crate) fn hand_rotation(pitch: f64, yaw: f64) -> Rotation {
    let ((sp, cp), (sy, cy)) = (math::sin_cos(pitch), math::sin_cos(yaw));
    let z = Vec3::new(cp * cy, cp * sy, sp);
    let y = Vec3::new(sy, -cy, 0.0);
    let r = nalgebra::Rotation3::from_matrix_unchecked(Mat3::from_columns(&[y.cross(&z), y, z]));
    Rotation::from_rotation_matrix(&r)
}

/// Returns the TCP pose at a distance in front of the fruit's centre \[m\] (negative: beyond it).
fn before(target: &Target, rotation: &Rotation, distance: f64) -> Pose {
    Pose::from_parts((target.p - rotation * Vec3::z() * distance).into(), *rotation)
}

/// Distance of the TCP beyond the fruit's centre at the grasp \[m\]. Fingers go beyond the centre by the overshoot; a cup goes beyond the near
/// skin of a fruit of this radius \[m\] by it, and so presses on the fruit.
pub(crate) fn grasp_depth(arm: &ArmKinematics, radius: f64, config: &PickerConfig) -> f64 {
    let overshoot = config.approach.overshoot.si();
    if arm.cup().is_some() { overshoot - radius } else { overshoot }
}

/// Distance that the TCP travels from the second look to the grasp \[m\].
pub(crate) fn advance_length(arm: &ArmKinematics, radius: f64, config: &PickerConfig) -> f64 {
    config.approach.look.si() + grasp_depth(arm, radius, config)
}

/// Returns the posture of the second look for a given orientation, if the arm can go straight on from there to the grasp and farther by a
/// margin \[m\].
pub(crate) fn look_posture(
    arm: &ArmKinematics,
    target: &Target,
    rotation: &Rotation,
    q_start: &JointVector,
    reach_margin: f64,
    config: &PickerConfig,
) -> Option<JointVector> {
    let (look, pregrasp) = (config.approach.look.si(), config.approach.pregrasp.si());
    let at = |distance: f64| IkTarget::Pose(before(target, rotation, distance));
    // The posture at the pre-grasp is solved first; from there postures are continued in both directions.
    let starts = [*q_start, arm.home()];
    let q_pregrasp = starts.iter().find_map(|q| arm.solve_near(&at(pregrasp), q).ok())?;
    let depth = grasp_depth(arm, target.radius, config);
    follow(arm, q_pregrasp, pregrasp, -depth - reach_margin, at, config)?;
    follow(arm, q_pregrasp, pregrasp, look, at, config)
}

/// Continues a posture along the approach, from one distance in front of the fruit to another \[m\].
fn follow(
    arm: &ArmKinematics,
    mut q: JointVector,
    from: f64,
    to: f64,
    at: impl Fn(f64) -> IkTarget,
    config: &PickerConfig,
) -> Option<JointVector> {
    let steps = ((to - from).abs() / config.approach.line_step.si()).ceil().max(1.0);
    for k in 1..=steps as u32 {
        let next = arm.solve_near(&at(from + (to - from) * f64::from(k) / steps), &q).ok()?;
        if (next - q).amax() > config.arm.branch_jump.si() {
            return None;
        }
        q = next;
    }
    Some(q)
}

/// Search for approaches to a target, base frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Search<'a> {
    pub arm: &'a ArmKinematics,
    pub config: &'a PickerConfig,
    pub target: &'a Target,
    /// Points that the camera saw.
    pub points: &'a [SeenPoint],
    /// Other fruit that it knows.
    pub others: &'a [Target],
    /// Directions from which something stopped the hand at this target.
    pub refused: &'a [Vec3],
    /// Posture from which the arm starts.
    pub q_start: &'a JointVector,
    /// Distance beyond the grasp that the arm must be able to reach \[m\].
    pub reach_margin: f64,
}

/// An orientation of the hand: the weights of the points in its path (`met`), and its cost by points, neighbours and turn, before the arm is asked.
#[derive(Debug, Clone, Copy)]
struct Ranked {
    cost: f64,
    met: f64,
    rotation: Rotation,
}

impl Search<'_> {
    /// Returns the approach of least cost.
    pub fn best(&self) -> Option<GraspPlan> {
        self.cheaper_than(f64::INFINITY)
    }

    /// Returns the approach of least cost, if it costs less than a limit. Approaches are tried in the order of their cost before the arm is asked; the search ends where that cost alone reaches the best whole cost.
    pub fn cheaper_than(&self, limit: f64) -> Option<GraspPlan> {
        let (mut best, mut reached) = (None::<GraspPlan>, 0);
        for ranked in self.ranked(|_| true, limit) {
            let limit = best.as_ref().map_or(limit, |best| best.cost);
            if ranked.cost >= limit || reached == self.config.approach.candidates.get() {
                break;
            }
            if let Some(plan) = self.reach(&ranked) {
                reached += 1;
                if plan.cost < limit {
                    best = Some(plan);
                }
            }
        }
        best
    }

    /// Returns the approaches of least cost that the arm can follow, among the allowed directions (base frame).
    pub fn approaches(&self, is_allowed: impl Fn(&Vec3) -> bool) -> Vec<GraspPlan> {
        let reachable =
            self.ranked(is_allowed, f64::INFINITY).into_iter().filter_map(|ranked| self.reach(&ranked));
        reachable.take(self.config.approach.candidates.get() as usize).collect()
    }

    /// Orientations of the hand whose directions are allowed, by their cost before the arm is asked, the least first; those that cost less than a limit.
    fn ranked(&self, is_allowed: impl Fn(&Vec3) -> bool, limit: f64) -> Vec<Ranked> {
        let Self { arm, config, target, .. } = *self;
        let c = &config.approach;
        let shoulder = arm.shoulder();
        let straight = math::atan2(target.p.y - shoulder.y, target.p.x - shoulder.x);
        let near = self.points_near(c.sweep_length.si() + c.sweep_half_y.si());
        let (refused_cost, same) =
            (config.blacklist.refused_cost.si(), math::cos(config.blacklist.refused_angle.si()));
        let mut ranked = Vec::with_capacity(c.elevations.len() * c.azimuths.len() * c.rolls.len());
        for elevation in &c.elevations {
            for azimuth in &c.azimuths {
                let level = hand_rotation(elevation.si(), straight + azimuth.si());
                if !is_allowed(&(level * Vec3::z())) {
                    continue;
                }
                let first = c.elevations[0].si();
                let direction = level * Vec3::z();
                let refused = self.refused.iter().filter(|d| d.dot(&direction) >= same).count() as f64;
                for roll in &c.rolls {
                    let rotation = level * Rotation::from_axis_angle(&Vec3::z_axis(), roll.si());
                    let turn = (elevation.si() - first).abs() + azimuth.si().abs() + roll.si().abs();
                    let (turn, refused) = (c.turn_cost.si() * turn, refused_cost * refused);
                    // Points can only add to the cost.
                    if turn + refused >= limit {
                        continue;
                    }
                    let [met, hiding] = self.in_the_way(&near, &rotation);
                    let brushed = self.brushed(&rotation) as f64;
                    let cost = met + c.hiding_cost.si() * hiding + turn;
                    let cost = cost + refused + c.brush_cost.si() * brushed;
                    ranked.push(Ranked { cost, met, rotation });
                }
            }
        }
        ranked.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        ranked
    }

    /// The plan of an orientation, if the arm can follow it, with the cost of the arm's turn.
    fn reach(&self, ranked: &Ranked) -> Option<GraspPlan> {
        let Self { arm, config, target, q_start, reach_margin, .. } = *self;
        let &Ranked { cost, met, rotation } = ranked;
        let q_look = look_posture(arm, target, &rotation, q_start, reach_margin, config)?;
        let cost = cost + config.approach.posture_cost.si() * (q_look - q_start).amax();
        Some(GraspPlan { rotation, q_look, met, cost })
    }

    /// Points near the fruit that do not belong to it.
    fn points_near(&self, farthest: f64) -> Vec<SeenPoint> {
        let own = self.target.radius + self.config.approach.fruit_margin.si();
        let is_near = |point: &&SeenPoint| {
            let d = (point.p - self.target.p).norm();
            d > own && d < farthest
        };
        self.points.iter().filter(is_near).copied().collect()
    }

    /// Number of other fruit that the open fingers touch on the straight approach; a cup has no fingers.
    pub fn brushed(&self, rotation: &Rotation) -> usize {
        if self.arm.cup().is_some() {
            return 0;
        }
        let depth = grasp_depth(self.arm, self.target.radius, self.config);
        let x_grasp = before(self.target, rotation, -depth);
        let touches =
            |other: &&Target| brushes(&inverse_transform(&x_grasp, &other.p), other.radius, self.config);
        self.others.iter().filter(touches).count()
    }

    /// Points in the path of the hand, by their weights, and number of points in the line of sight of the second look.
    fn in_the_way(&self, near: &[SeenPoint], rotation: &Rotation) -> [f64; 2] {
        let (target, c) = (self.target, &self.config.approach);
        let x_grasp = before(target, rotation, -grasp_depth(self.arm, target.radius, self.config));
        let met = near.iter().filter(|point| in_sweep(&inverse_transform(&x_grasp, &point.p), self.config));
        let met = met.map(|point| point.weight(c.wood_weight.si())).sum();
        let x_camera = before(target, rotation, c.look.si()) * self.arm.x_tcp_camera();
        let p_camera = x_camera.translation.vector;
        let hiding = near.iter().filter(|point| is_before(&point.p, &p_camera, target)).count() as f64;
        [met, hiding]
    }
}

/// True if a fruit of this radius \[m\] at a point of the TCP's frame at the grasp comes too near to the volume that the open fingers sweep on their
/// straight way there.
fn brushes(p_tcp: &Vec3, radius: f64, config: &PickerConfig) -> bool {
    let c = &config.approach;
    let beyond = |x: f64, low: f64, high: f64| (low - x).max(x - high).max(0.0);
    let off = Vec3::new(
        beyond(p_tcp.x.abs(), 0.0, c.finger_half_x.si()),
        beyond(p_tcp.y.abs(), config.grasp.opening.si(), c.finger_outer.si()),
        beyond(p_tcp.z, f64::NEG_INFINITY, c.sweep_tip.si()),
    );
    off.norm() < radius + c.brush_margin.si()
}

/// True if a point lies in the cone from the camera to the fruit, in front of the fruit.
fn is_before(p: &Vec3, p_camera: &Vec3, target: &Target) -> bool {
    let sight = target.p - p_camera;
    let share = (p - p_camera).dot(&sight) / sight.norm_squared();
    let aside = (p - p_camera - sight * share).norm();
    share > 0.0 && share < 1.0 && aside < target.radius * share
}

/// Counts the points (base frame), by their weights, that the hand would meet while the joints move in proportion from one posture to another; each counts
/// once.
pub(crate) fn swept(
    arm: &ArmKinematics,
    points: &[SeenPoint],
    [from, to]: [&JointVector; 2],
    config: &PickerConfig,
) -> f64 {
    let steps = ((to - from).amax() / config.arm.branch_jump.si()).ceil().max(1.0);
    let x_tcp: Vec<Pose> = (1..=steps as u32)
        .map(|k| arm.tcp(&(from + (to - from) * (f64::from(k) / steps))).inverse())
        .collect();
    let is_met = |point: &&SeenPoint| x_tcp.iter().any(|x| in_hand(&transform(x, &point.p), config));
    points.iter().filter(is_met).map(|point| point.weight(config.approach.wood_weight.si())).sum()
}

/// True if a point of the TCP's frame lies in the volume of hand and fingers.
fn in_hand(p_tcp: &Vec3, config: &PickerConfig) -> bool {
    let c = &config.approach;
    in_sweep(p_tcp, config) && p_tcp.z >= -c.hand_length.si()
}

/// True if a point of the TCP's frame lies in the volume that hand and fingers sweep on the straight approach.
pub(crate) fn in_sweep(p_tcp: &Vec3, config: &PickerConfig) -> bool {
    let c = &config.approach;
    p_tcp.x.abs() <= c.sweep_half_x.si()
        && p_tcp.y.abs() <= c.sweep_half_y.si()
        && p_tcp.z <= c.sweep_tip.si()
        && p_tcp.z >= -c.sweep_length.si()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;
    use orchard_robot::RobotModel;

    const TARGET: Target = Target { p: Vec3::new(0.7, 0.0, 0.9), radius: 0.03 };

    fn search<'a>(
        arm: &'a ArmKinematics,
        config: &'a PickerConfig,
        points: &'a [SeenPoint],
        q_start: &'a JointVector,
    ) -> Search<'a> {
        Search { arm, config, target: &TARGET, points, others: &[], refused: &[], q_start, reach_margin: 0.0 }
    }

    fn seen(p: Vec3, is_wood: bool) -> SeenPoint {
        SeenPoint { p, is_wood }
    }

    /// Points in the line of sight of the second look, but beside the hand's path, change the choice to a direction from which the fruit is
    /// seen; at cost 0 they do not.
    #[test]
    fn what_hides_the_fruit_turns_the_approach() {
        let (robot, expert) = (RobotModel::paper(), ExpertConfig::preset());
        let (arm, mut config) = (robot.kinematics(), expert.shared);
        let q = arm.home();
        let free = search(arm, &config, &[], &q).best().expect("within reach");
        let x_camera = before(&TARGET, &free.rotation, config.approach.look.si()) * arm.x_tcp_camera();
        let p_camera = x_camera.translation.vector;
        let x_grasp = before(&TARGET, &free.rotation, -config.approach.overshoot.si());
        let on_the_sight = |share: f64| p_camera + (TARGET.p - p_camera) * share;
        let is_free = |p: &Vec3| !in_sweep(&inverse_transform(&x_grasp, p), &config);
        let points = (1..60).map(|k| on_the_sight(f64::from(k) / 80.0)).filter(is_free);
        let points: Vec<SeenPoint> = points.map(|p| seen(p, false)).collect();
        assert!(points.len() > 10, "the camera sees past the hand: {}", points.len());
        let other = search(arm, &config, &points, &q).best().expect("within reach");
        assert!(other.direction().dot(&free.direction()) < 0.99);
        config.approach.hiding_cost = config.approach.hiding_cost.with_value(0.0).expect("in range");
        let careless = search(arm, &config, &points, &q).best().expect("within reach");
        assert_eq!(careless.direction(), free.direction());
    }

    /// A direction from which something stopped the hand is taken last; at cost 0 it is taken again.
    #[test]
    fn another_direction_than_a_refused_one_is_taken() {
        let (robot, expert) = (RobotModel::paper(), ExpertConfig::preset());
        let (arm, mut config) = (robot.kinematics(), expert.shared);
        let q = arm.home();
        let first = search(arm, &config, &[], &q).best().expect("within reach").direction();
        let next = |config: &PickerConfig| {
            let search = Search { refused: &[first], ..search(arm, config, &[], &q) };
            search.best().expect("within reach").direction()
        };
        let angle = config.blacklist.refused_angle.si();
        assert!(next(&config).dot(&first) < math::cos(angle));
        config.blacklist.refused_cost = config.blacklist.refused_cost.with_value(0.0).expect("in range");
        assert_eq!(next(&config), first);
    }

    /// Fruit left and right of the target turn the hand about its approach axis, so that the open fingers pass them; at cost 0, or unknown, they do not.
    #[test]
    fn the_hand_rolls_past_neighbours() {
        let (robot, expert) = (RobotModel::paper(), ExpertConfig::preset());
        let (arm, mut config) = (robot.kinematics(), expert.shared);
        let q = arm.home();
        let others = [0.07, -0.07].map(|y| Target { p: TARGET.p + Vec3::y() * y, radius: 0.03 });
        let best = |config: &PickerConfig, others: &[Target]| {
            let search = Search { others, ..search(arm, config, &[], &q) };
            let plan = search.best().expect("within reach");
            (search.brushed(&plan.rotation), (plan.rotation * Vec3::y()).z.abs())
        };
        let (brushed, tilt) = best(&config, &others);
        assert!(brushed == 0 && tilt > 0.5, "{brushed} {tilt}");
        assert!(best(&config, &[]).1 < 1e-9);
        config.approach.brush_cost = config.approach.brush_cost.with_value(0.0).expect("in range");
        let (brushed, tilt) = best(&config, &others);
        assert!(brushed > 0 && tilt < 1e-9, "{brushed} {tilt}");
    }

    /// A finger lies from the gap's half to its outer side, and behind its tip; the fruit between the fingers is clear of both.
    #[test]
    fn fingers_touch_what_lies_beside_them() {
        let config = ExpertConfig::preset().shared;
        let (gap, tip) = (config.grasp.opening.si(), config.approach.sweep_tip.si());
        let clear = 0.01 + config.approach.brush_margin.si();
        let at = |y: f64, z: f64| brushes(&Vec3::new(0.0, y, z), 0.01, &config);
        assert!(!at(0.0, 0.0) && at(gap, 0.0) && at(-gap, -0.3));
        assert!(at(gap - clear + 1e-4, 0.0) && !at(gap - clear - 1e-4, 0.0));
        assert!(at(gap, tip + clear - 1e-4) && !at(gap, tip + clear + 1e-4));
    }

    /// Points on the path of the hand count, each once, and wood by its weight; points beside and behind it do not.
    #[test]
    fn a_swing_meets_what_lies_in_its_way() {
        let (robot, expert) = (RobotModel::paper(), ExpertConfig::preset());
        let (arm, config) = (robot.kinematics(), &expert.shared);
        let from = arm.home();
        let mut to = from;
        to[0] += 1.2;
        let at = |share: f64, offset: Vec3| {
            let x = arm.tcp(&(from + (to - from) * share));
            x.translation.vector + x.rotation * offset
        };
        let palm = Vec3::new(0.0, 0.0, -0.5 * config.approach.hand_length.si());
        let met = [0.25, 0.5, 0.75, 1.0].map(|share| seen(at(share, palm), false));
        assert_eq!(swept(arm, &met, [&from, &to], config), 4.0);
        let wood = met.map(|leaf| seen(leaf.p, true));
        assert_eq!(swept(arm, &wood, [&from, &to], config), 4.0 * config.approach.wood_weight.si());
        let beyond = Vec3::new(0.0, 0.0, 0.05);
        let behind = Vec3::new(0.0, 0.0, -config.approach.hand_length.si() - 0.05);
        let passed = [beyond, behind].map(|offset| seen(at(0.5, offset), true));
        assert_eq!(swept(arm, &passed, [&from, &to], config), 0.0);
        // The joint turns about the vertical: a point above the hand's thickness stays clear.
        let above = met[0].p + Vec3::z() * (config.approach.sweep_half_y.si() + 0.1);
        assert_eq!(swept(arm, &[seen(above, true)], [&from, &to], config), 0.0);
    }

    /// A place counts only if the arm reaches beyond the grasp by the margin.
    #[test]
    fn the_reach_margin_shortens_the_reach() {
        let (robot, expert) = (RobotModel::paper(), ExpertConfig::preset());
        let (arm, config) = (robot.kinematics(), &expert.shared);
        let q = arm.home();
        let rotation = hand_rotation(0.0, 0.0);
        let reaches = |x: f64, margin: f64| {
            let target = Target { p: Vec3::new(x, 0.0, 0.9), radius: 0.03 };
            look_posture(arm, &target, &rotation, &q, margin, config).is_some()
        };
        let farthest =
            |margin: f64| (60..130).rev().map(|k| 0.01 * f64::from(k)).find(|x| reaches(*x, margin));
        let (bare, shorter) = (farthest(0.0).expect("reached"), farthest(0.1).expect("reached"));
        // A centimetre either way for the grid.
        assert!((bare - shorter - 0.1).abs() <= 0.011, "{bare} {shorter}");
    }
}
