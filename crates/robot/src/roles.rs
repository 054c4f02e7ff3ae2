//! Roles of an articulation's joints and links: base, arm, fingers, hand, bucket.

use crate::RobotError;
use crate::articulation::{Articulation, Limit};
use crate::config::Parts;
use crate::handle::Bucket;
use crate::io::ARM_DOF;
use nalgebra::Unit;
use orchard_geometry::{Pose, Shape, Vec3};
use orchard_multibody::JointKind;

/// Links of an articulation by their role in a harvester.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Roles {
    pub planar: usize,
    pub height: usize,
    /// Link that carries the `base` frame.
    pub base: usize,
    pub x_link_base: Pose,
    pub arm: [usize; ARM_DOF],
    pub arm_axes: [Unit<Vec3>; ARM_DOF],
    pub arm_limits: [Limit; ARM_DOF],
    pub fingers: [usize; 2],
    pub finger_axes: [Unit<Vec3>; 2],
    pub finger_limits: [Limit; 2],
    pub bucket: Bucket,
}

/// A joint with one degree of freedom.
struct OneAxis {
    link: usize,
    axis: Unit<Vec3>,
    limit: Limit,
}

impl Roles {
    pub fn find(articulation: &Articulation, parts: &Parts) -> Result<Self, RobotError> {
        let base_frame = articulation
            .frame(&parts.base_link)
            .ok_or_else(|| missing_link("base_link", &parts.base_link))?;
        let base = base_frame.link.ok_or_else(|| missing_link("base_link (moving)", &parts.base_link))?;
        let planar = articulation
            .link_of_joint(&parts.base_joint)
            .filter(|&l| articulation.links[l].joint == JointKind::Planar)
            .filter(|&l| articulation.links[l].parent.is_none())
            .ok_or_else(|| missing_joint("base_joint", "planar (on the root link)", &parts.base_joint))?;
        let height = one_axis(articulation, "height_joint", &parts.height_joint, Freedom::Slide, planar)?;
        if height.link != base {
            return Err(missing_link("base_link (on height_joint)", &parts.base_link));
        }
        let mut arm = Vec::with_capacity(ARM_DOF);
        let mut parent = base;
        for joint in &parts.arm_joints {
            let found = one_axis(articulation, "arm_joints", joint, Freedom::Hinge, parent)?;
            parent = found.link;
            arm.push(found);
        }
        let finger = |i: usize| {
            one_axis(articulation, "finger_joints", &parts.finger_joints[i], Freedom::Slide, parent)
        };
        let fingers = [finger(0)?, finger(1)?];
        Ok(Self {
            planar,
            height: height.link,
            base,
            x_link_base: base_frame.x_link_frame,
            arm: std::array::from_fn(|i| arm[i].link),
            arm_axes: std::array::from_fn(|i| arm[i].axis),
            arm_limits: std::array::from_fn(|i| arm[i].limit),
            finger_axes: [fingers[0].axis, fingers[1].axis],
            finger_limits: [fingers[0].limit, fingers[1].limit],
            fingers: [fingers[0].link, fingers[1].link],
            bucket: bucket_interior(articulation, parts, base, &base_frame.x_link_frame)?,
        })
    }

    /// Pose of a URDF link that must be fixed to the moving link `on`.
    pub fn frame_on(&self, articulation: &Articulation, name: &str, on: usize) -> Result<Pose, RobotError> {
        match articulation.frame(name) {
            Some(frame) if frame.link == Some(on) => Ok(frame.x_link_frame),
            _ => Err(missing_link("config (on the last arm joint)", name)),
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Freedom {
    Hinge,
    Slide,
}

fn one_axis(
    articulation: &Articulation,
    by: &str,
    joint: &str,
    freedom: Freedom,
    parent: usize,
) -> Result<OneAxis, RobotError> {
    let kind = match freedom {
        Freedom::Hinge => "revolute (on the link before it)",
        Freedom::Slide => "prismatic (on the link before it)",
    };
    let link = articulation
        .link_of_joint(joint)
        .filter(|&l| articulation.links[l].parent == Some(parent))
        .ok_or_else(|| missing_joint(by, kind, joint))?;
    let found = &articulation.links[link];
    match (found.joint, freedom, found.limit) {
        (JointKind::Hinge(axis), Freedom::Hinge, Some(limit))
        | (JointKind::Slide(axis), Freedom::Slide, Some(limit))
            if limit.lower.is_finite() && limit.upper.is_finite() =>
        {
            Ok(OneAxis { link, axis, limit })
        }
        _ => Err(missing_joint(by, kind, joint)),
    }
}

fn missing_link(by: &str, link: &str) -> RobotError {
    RobotError::MissingLink { by: by.to_owned(), link: link.to_owned() }
}

fn missing_joint(by: &str, kind: &'static str, joint: &str) -> RobotError {
    RobotError::MissingJoint { by: by.to_owned(), kind, joint: joint.to_owned() }
}

/// Interior of a bucket of upright boxes: between the walls, from the floor to the rim.
fn bucket_interior(
    articulation: &Articulation,
    parts: &Parts,
    base: usize,
    x_link_base: &Pose,
) -> Result<Bucket, RobotError> {
    let boxes: Vec<_> = articulation.links[base]
        .shapes
        .iter()
        .filter(|s| s.part == parts.bucket_link && matches!(s.shape, Shape::Box { .. }))
        .map(|s| s.shape.aabb(&(x_link_base.inverse() * s.x_link_shape)))
        .collect();
    let outer = boxes.iter().copied().reduce(|a, b| a.union(&b));
    let Some(outer) = outer else {
        return Err(missing_link("bucket_link (boxes on the base)", &parts.bucket_link));
    };
    let centre = (outer.min + outer.max) * 0.5;
    let (mut low, mut high) = (outer.min, outer.max);
    for wall in &boxes {
        for k in 0..3 {
            if wall.max[k] < centre[k] {
                low[k] = low[k].max(wall.max[k]);
            } else if wall.min[k] > centre[k] {
                high[k] = high[k].min(wall.min[k]);
            }
        }
    }
    Ok(Bucket { p_base: (low + high) * 0.5, half: (high - low) * 0.5 })
}
