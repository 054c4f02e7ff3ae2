//! From where to grasp a fruit: approach directions that the arm can follow, judged by what is in the way of the hand and
//! of the camera's second look, and by how far the arm turns.

use crate::config::PickerConfig;
use orchard_geometry::{Mat3, Pose, Rotation, Vec3, inverse_transform, math, transform};
use orchard_robot::{ArmKinematics, IkTarget, JointVector};

/// A fruit, in some frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Target {
    pub p: Vec3,
    pub radius: f64,
}

/// A way to grasp: orientation of the hand and the postures along its straight approach, base frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GraspPlan {
    /// Orientation of the TCP.
    pub rotation: Rotation,
    /// Posture of the second look.
    pub q_look: JointVector,
    /// Points in the way of hand and sight, and turning, in points.
    pub cost: f64,
}

impl GraspPlan {
    /// Direction of the approach, base frame.
    pub fn direction(&self) -> Vec3 {
        self.rotation * Vec3::z()
    }
}

/// Orientation of a hand that looks along a direction with the camera's side up: x in the vertical plane.
pub(crate) fn hand_rotation(pitch: f64, yaw: f64) -> Rotation {
    let ((sp, cp), (sy, cy)) = (math::sin_cos(pitch), math::sin_cos(yaw));
    let z = Vec3::new(cp * cy, cp * sy, sp);
    let y = Vec3::new(sy, -cy, 0.0);
    let r = nalgebra::Rotation3::from_matrix_unchecked(Mat3::from_columns(&[y.cross(&z), y, z]));
    Rotation::from_rotation_matrix(&r)
}

/// TCP pose at a distance before the fruit (negative: beyond its centre).
fn before(target: &Target, rotation: &Rotation, distance: f64) -> Pose {
    Pose::from_parts((target.p - rotation * Vec3::z() * distance).into(), *rotation)
}

/// Distance that the TCP travels from the second look to the grasp.
pub(crate) fn advance_length(config: &PickerConfig) -> f64 {
    config.approach.look.si() + config.approach.overshoot.si()
}

/// Posture of the second look for a given orientation, if the arm can go straight on from there to the grasp, and farther
/// by a margin [m].
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
    // The middle of the line decides; from there postures are continued both ways.
    let starts = [*q_start, arm.home()];
    let q_pregrasp = starts.iter().find_map(|q| arm.solve_near(&at(pregrasp), q).ok())?;
    follow(arm, q_pregrasp, pregrasp, -config.approach.overshoot.si() - reach_margin, at, config)?;
    follow(arm, q_pregrasp, pregrasp, look, at, config)
}

/// Continues a posture along the approach, from one distance before the fruit to another.
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

/// A search for ways to grasp, base frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Search<'a> {
    pub arm: &'a ArmKinematics,
    pub config: &'a PickerConfig,
    pub target: &'a Target,
    /// What the camera saw.
    pub points: &'a [Vec3],
    /// Where the arm starts from.
    pub q_start: &'a JointVector,
    /// The arm must reach so much farther than the grasp [m].
    pub reach_margin: f64,
}

impl Search<'_> {
    /// The cheapest approach.
    pub fn best(&self) -> Option<GraspPlan> {
        self.ways(|_| true).into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Approaches that the arm can follow among the directions (base frame) that are allowed, those with least in the way.
    pub fn ways(&self, is_allowed: impl Fn(&Vec3) -> bool) -> Vec<GraspPlan> {
        let Self { arm, config, target, .. } = *self;
        let c = &config.approach;
        let shoulder = arm.shoulder();
        let straight = math::atan2(target.p.y - shoulder.y, target.p.x - shoulder.x);
        let near = self.points_near(c.sweep_length.si() + c.sweep_half_y.si());
        let mut ways = Vec::with_capacity(c.elevations.len() * c.azimuths.len());
        for elevation in &c.elevations {
            for azimuth in &c.azimuths {
                let rotation = hand_rotation(elevation.si(), straight + azimuth.si());
                if !is_allowed(&(rotation * Vec3::z())) {
                    continue;
                }
                let first = c.elevations[0].si();
                let turn = (elevation.si() - first).abs() + azimuth.si().abs();
                ways.push((self.in_the_way(&near, &rotation) + c.turn_cost.si() * turn, rotation));
            }
        }
        ways.sort_by(|a, b| a.0.total_cmp(&b.0));
        let reachable = ways.into_iter().filter_map(|(cost, rotation)| {
            let q_look = look_posture(arm, target, &rotation, self.q_start, self.reach_margin, config)?;
            let cost = cost + c.posture_cost.si() * (q_look - self.q_start).amax();
            Some(GraspPlan { rotation, q_look, cost })
        });
        reachable.take(c.candidates.get() as usize).collect()
    }

    /// Points near the fruit that are not its own.
    fn points_near(&self, farthest: f64) -> Vec<Vec3> {
        let own = self.target.radius + self.config.approach.fruit_margin.si();
        let is_near = |p: &&Vec3| {
            let d = (*p - self.target.p).norm();
            d > own && d < farthest
        };
        self.points.iter().filter(is_near).copied().collect()
    }

    /// Points in the way of the hand, and of the camera's second look at their weight.
    fn in_the_way(&self, near: &[Vec3], rotation: &Rotation) -> f64 {
        let (target, c) = (self.target, &self.config.approach);
        let x_grasp = before(target, rotation, -c.overshoot.si());
        let met = near.iter().filter(|p| in_sweep(&inverse_transform(&x_grasp, p), self.config)).count();
        let x_camera = before(target, rotation, c.look.si()) * self.arm.x_tcp_camera();
        let p_camera = x_camera.translation.vector;
        let hiding = near.iter().filter(|p| is_before(p, &p_camera, target)).count();
        met as f64 + c.hiding_cost.si() * hiding as f64
    }
}

/// Whether a point lies within the cone from the camera about the fruit, before the fruit.
fn is_before(p: &Vec3, p_camera: &Vec3, target: &Target) -> bool {
    let sight = target.p - p_camera;
    let share = (p - p_camera).dot(&sight) / sight.norm_squared();
    let aside = (p - p_camera - sight * share).norm();
    share > 0.0 && share < 1.0 && aside < target.radius * share
}

/// Points (base frame) that the hand would meet while the joints go in proportion from one posture to another; each
/// counts once.
pub(crate) fn swept(
    arm: &ArmKinematics,
    points: &[Vec3],
    [from, to]: [&JointVector; 2],
    config: &PickerConfig,
) -> usize {
    let steps = ((to - from).amax() / config.arm.branch_jump.si()).ceil().max(1.0);
    let x_tcp: Vec<Pose> = (1..=steps as u32)
        .map(|k| arm.tcp(&(from + (to - from) * (f64::from(k) / steps))).inverse())
        .collect();
    let is_met = |p: &&Vec3| x_tcp.iter().any(|x| in_hand(&transform(x, p), config));
    points.iter().filter(is_met).count()
}

/// Whether a point of the TCP's frame lies where hand and fingers are.
fn in_hand(p_tcp: &Vec3, config: &PickerConfig) -> bool {
    let c = &config.approach;
    in_sweep(p_tcp, config) && p_tcp.z >= -c.hand_length.si()
}

pub(crate) fn in_sweep(p_tcp: &Vec3, config: &PickerConfig) -> bool {
    let c = &config.approach;
    p_tcp.x.abs() <= c.sweep_half_x.si()
        && p_tcp.y.abs() <= c.sweep_half_y.si()
        && p_tcp.z <= c.sweep_tip.si()
        && p_tcp.z >= -c.sweep_length.si()
}
