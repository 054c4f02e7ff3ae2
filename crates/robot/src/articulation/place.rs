//! Poses and axes as a description writes them.

use crate::RobotError;
use crate::plausible::{LENGTH_MAX, POSITION_MAX, within};
use nalgebra::Unit;
use orchard_geometry::{Pose, Rotation, Vec3, rotation_from_z};
use orchard_multibody::JointKind;
use urdf_rs::JointType;

/// Pose of an `origin` element; `place` names it in errors.
pub(super) fn pose_of(place: &str, origin: &urdf_rs::Pose) -> Result<Pose, RobotError> {
    let (xyz, rpy) = (origin.xyz.0, origin.rpy.0);
    within(place, &xyz, LENGTH_MAX)?;
    within(place, &rpy, POSITION_MAX)?;
    Ok(Pose::from_parts(Vec3::from(xyz).into(), Rotation::from_euler_angles(rpy[0], rpy[1], rpy[2])))
}

/// Kind of a joint, and the turn of its own frame against that of the description if they differ: a planar joint moves in the x-y plane of its
/// own frame.
pub(super) fn kind_of(joint: &urdf_rs::Joint) -> Result<(JointKind, Option<Rotation>), RobotError> {
    within(&format!("axis of joint `{}`", joint.name), &joint.axis.xyz.0, POSITION_MAX)?;
    let axis = || {
        let v = Vec3::from(joint.axis.xyz.0);
        Unit::try_new(v, 1e-9).ok_or_else(|| RobotError::Axis {
            joint: joint.name.clone(),
            axis: format!("{:?}", joint.axis.xyz.0),
            problem: "is no direction",
        })
    };
    let kind = match joint.joint_type {
        JointType::Revolute | JointType::Continuous => JointKind::Hinge(axis()?),
        JointType::Prismatic => JointKind::Slide(axis()?),
        JointType::Planar => {
            let normal = axis()?;
            let is_z = (normal.z - 1.0).abs() <= 1e-12;
            return Ok((JointKind::Planar, (!is_z).then(|| rotation_from_z(&normal))));
        }
        JointType::Floating => JointKind::Free,
        JointType::Fixed => JointKind::Weld,
        JointType::Spherical => {
            return Err(RobotError::JointType { joint: joint.name.clone(), kind: "spherical".to_owned() });
        }
    };
    Ok((kind, None))
}

/// Pose of the frame beyond a joint against that before it, at a position of a hinge or slide.
pub(crate) fn moved_by(kind: &JointKind, position: f64) -> Pose {
    match kind {
        JointKind::Hinge(axis) => {
            Pose::from_parts(Default::default(), Rotation::from_axis_angle(axis, position))
        }
        JointKind::Slide(axis) => {
            Pose::from_parts((axis.into_inner() * position).into(), Rotation::identity())
        }
        _ => Pose::identity(),
    }
}
