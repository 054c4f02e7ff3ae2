//! Fixed postures of the harvest cycle, computed once.

use crate::config::{PickerConfig, PostureConfig};
use crate::plan::hand_rotation;
use orchard_geometry::{Pose, Rotation, Vec3};
use orchard_robot::{ArmKinematics, Bucket, IkTarget, JointVector};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Fixed postures of the arm \[rad\].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Postures {
    /// Postures for looking around; the first is also the one for driving and carrying.
    pub survey: Vec<JointVector>,
    /// Postures above the bucket and lowered to let go; `None` if the arm does not reach there.
    pub bucket: Option<[JointVector; 2]>,
    /// The bucket's axis, base frame.
    pub p_bucket: Vec3,
}

impl Postures {
    pub fn new(arm: &ArmKinematics, bucket: &Bucket, config: &PickerConfig) -> Self {
        let survey = |c: &PostureConfig| {
            let rotation = hand_rotation(c.pitch.si(), c.yaw.si());
            let x = Pose::from_parts(Vec3::new(c.x.si(), 0.0, c.z.si()).into(), rotation);
            arm.solve(&IkTarget::Pose(x), &arm.home()).unwrap_or(arm.home())
        };
        let mut survey: Vec<_> = config.scan.postures.iter().map(survey).collect();
        if survey.is_empty() {
            survey.push(arm.home());
        }
        let heights = [config.deposit.above.si(), config.deposit.release.si()];
        let bucket_postures = hand_down(arm, &bucket.p_base, heights, &TURNS, &survey[0]);
        Self { survey, bucket: bucket_postures, p_bucket: bucket.p_base }
    }

    /// Posture for driving and carrying.
    pub fn carry(&self) -> JointVector {
        self.survey[0]
    }
}

/// Turns of the hand about the vertical that are tried above the bucket's axis \[rad\].
const TURNS: [f64; 8] =
    [0.0, FRAC_PI_4, FRAC_PI_2, 3.0 * FRAC_PI_4, PI, 5.0 * FRAC_PI_4, 3.0 * FRAC_PI_2, 7.0 * FRAC_PI_4];

/// Turns with the fingers moving across the base \[rad\]: the hand's width then fits between the walls at any place along the bucket.
pub(crate) const ACROSS: [f64; 2] = [0.0, PI];

/// Returns the postures with the hand pointing down above a place (base frame, height ignored) and lowered to it: of the given turns of the
/// hand and both senses of rotation, those nearest to `carry`.
pub(crate) fn hand_down(
    arm: &ArmKinematics,
    place: &Vec3,
    [above, low]: [f64; 2],
    turns: &[f64],
    carry: &JointVector,
) -> Option<[JointVector; 2]> {
    let mut best: Option<(f64, [JointVector; 2])> = None;
    for turn in turns {
        let rotation = Rotation::from_euler_angles(PI, 0.0, *turn);
        let at = |z: f64| IkTarget::Pose(Pose::from_parts(Vec3::new(place.x, place.y, z).into(), rotation));
        for side in [arm.limits()[0].lower, arm.limits()[0].upper] {
            let mut start = arm.home();
            start[0] = side;
            let Ok(q_above) = arm.solve_near(&at(above), &start) else { continue };
            let Ok(q_low) = arm.solve_near(&at(low), &q_above) else { continue };
            let turn = (q_above - carry).amax();
            if best.is_none_or(|(shortest, _)| turn < shortest) {
                best = Some((turn, [q_above, q_low]));
            }
        }
    }
    best.map(|(_, postures)| postures)
}
