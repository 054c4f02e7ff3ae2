//! Postures that the cycle returns to, found once.

use crate::config::{PickerConfig, PostureConfig};
use crate::plan::hand_rotation;
use orchard_geometry::{Pose, Rotation, Vec3};
use orchard_robot::{ArmKinematics, Bucket, IkTarget, JointVector};
use std::f64::consts::{FRAC_PI_4, PI};

/// Fixed postures of the arm.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Postures {
    /// Looking around; the first is also the one for driving and carrying.
    pub survey: Vec<JointVector>,
    /// Over the bucket, and lowered to let go; `None` if the arm does not reach there.
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
        let bucket_postures = over_bucket(arm, bucket, &survey[0], config);
        Self { survey, bucket: bucket_postures, p_bucket: bucket.p_base }
    }

    /// The posture for driving and carrying.
    pub fn carry(&self) -> JointVector {
        self.survey[0]
    }
}

/// Hand down over the bucket's axis: of all turns of the hand and both ways round, the posture nearest to `carry`.
fn over_bucket(
    arm: &ArmKinematics,
    bucket: &Bucket,
    carry: &JointVector,
    config: &PickerConfig,
) -> Option<[JointVector; 2]> {
    let c = &config.deposit;
    let mut best: Option<(f64, [JointVector; 2])> = None;
    for turn in 0..8 {
        let rotation = Rotation::from_euler_angles(PI, 0.0, f64::from(turn) * FRAC_PI_4);
        let at = |z: f64| {
            let p = Vec3::new(bucket.p_base.x, bucket.p_base.y, z);
            IkTarget::Pose(Pose::from_parts(p.into(), rotation))
        };
        for side in [arm.limits()[0].lower, arm.limits()[0].upper] {
            let mut start = arm.home();
            start[0] = side;
            let Ok(above) = arm.solve_near(&at(c.above.si()), &start) else { continue };
            let Ok(low) = arm.solve_near(&at(c.release.si()), &above) else { continue };
            let way = (above - carry).amax();
            if best.is_none_or(|(shortest, _)| way < shortest) {
                best = Some((way, [above, low]));
            }
        }
    }
    best.map(|(_, postures)| postures)
}
