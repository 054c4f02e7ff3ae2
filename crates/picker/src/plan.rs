//! From where to grasp a fruit: approach directions that the arm can follow, least in the way first.

use crate::config::PickerConfig;
use orchard_geometry::{Mat3, Pose, Rotation, Vec3, inverse_transform, math};
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
    /// Points in the way and turning, in points.
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

/// Posture of the second look for a given orientation, if the arm can go straight on from there to the grasp.
pub(crate) fn look_posture(
    arm: &ArmKinematics,
    target: &Target,
    rotation: &Rotation,
    q_start: &JointVector,
    config: &PickerConfig,
) -> Option<JointVector> {
    let (look, pregrasp) = (config.approach.look.si(), config.approach.pregrasp.si());
    let at = |distance: f64| IkTarget::Pose(before(target, rotation, distance));
    // The middle of the line decides; from there postures are continued both ways.
    let starts = [*q_start, arm.home()];
    let q_pregrasp = starts.iter().find_map(|q| arm.solve_near(&at(pregrasp), q).ok())?;
    follow(arm, q_pregrasp, pregrasp, -config.approach.overshoot.si(), at, config)?;
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

/// The cheapest approach that the arm can follow. `points` are what the camera saw, base frame.
pub(crate) fn plan(
    arm: &ArmKinematics,
    target: &Target,
    points: &[Vec3],
    q_start: &JointVector,
    config: &PickerConfig,
) -> Option<GraspPlan> {
    plan_among(arm, target, points, q_start, config, |_| true)
}

/// As [`plan`], among the directions (base frame) that are allowed.
pub(crate) fn plan_among(
    arm: &ArmKinematics,
    target: &Target,
    points: &[Vec3],
    q_start: &JointVector,
    config: &PickerConfig,
    is_allowed: impl Fn(&Vec3) -> bool,
) -> Option<GraspPlan> {
    let c = &config.approach;
    let shoulder = arm.shoulder();
    let straight = math::atan2(target.p.y - shoulder.y, target.p.x - shoulder.x);
    let near: Vec<Vec3> = points
        .iter()
        .filter(|p| {
            let d = (*p - target.p).norm();
            d > target.radius + c.fruit_margin.si() && d < c.sweep_length.si() + c.sweep_half_y.si()
        })
        .copied()
        .collect();
    let mut ways = Vec::with_capacity(c.elevations.len() * c.azimuths.len());
    for elevation in &c.elevations {
        for azimuth in &c.azimuths {
            let rotation = hand_rotation(elevation.si(), straight + azimuth.si());
            if !is_allowed(&(rotation * Vec3::z())) {
                continue;
            }
            let x_grasp = before(target, &rotation, -c.overshoot.si());
            let in_the_way =
                near.iter().filter(|p| in_sweep(&inverse_transform(&x_grasp, p), config)).count();
            let first = c.elevations[0].si();
            let turn = (elevation.si() - first).abs() + azimuth.si().abs();
            ways.push((in_the_way as f64 + c.turn_cost.si() * turn, rotation));
        }
    }
    ways.sort_by(|a, b| a.0.total_cmp(&b.0));
    let reachable = ways.into_iter().filter_map(|(cost, rotation)| {
        let q_look = look_posture(arm, target, &rotation, q_start, config)?;
        let cost = cost + c.posture_cost.si() * (q_look - q_start).amax();
        Some(GraspPlan { rotation, q_look, cost })
    });
    reachable.take(c.candidates.get() as usize).min_by(|a, b| a.cost.total_cmp(&b.cost))
}

fn in_sweep(p_tcp: &Vec3, config: &PickerConfig) -> bool {
    let c = &config.approach;
    p_tcp.x.abs() <= c.sweep_half_x.si()
        && p_tcp.y.abs() <= c.sweep_half_y.si()
        && p_tcp.z <= c.sweep_tip.si()
        && p_tcp.z >= -c.sweep_length.si()
}
