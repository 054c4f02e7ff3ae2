//! Roles of an articulation's joints and links: base, arm, fingers, hand, bucket.

use crate::RobotError;
use crate::articulation::{Articulation, Frame, Limit};
use crate::base::BaseJoint;
use crate::config::Parts;
use crate::finger::{self, FoundFinger};
use crate::handle::Bucket;
use nalgebra::Unit;
use orchard_geometry::{Pose, Shape, Vec3};
use orchard_multibody::JointKind;

/// Links of an articulation by their role in a harvester.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Roles {
    pub base_joint: BaseJoint<usize>,
    pub height: Option<usize>,
    /// Link that carries the `base` frame.
    pub base: usize,
    pub x_link_base: Pose,
    /// From the shoulder out; at least one.
    pub arm: Vec<usize>,
    pub arm_axes: Vec<Unit<Vec3>>,
    pub arm_limits: Vec<Limit>,
    /// The two fingers; none for a hand with a suction cup.
    pub fingers: Vec<FoundFinger>,
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
        let base_joint = base_joint(articulation, parts, base_frame)?;
        let mut carrier = base_joint.moving().copied();
        let mut height = None;
        if let Some(joint) = &parts.height_joint {
            let found = one_axis(articulation, "height_joint", joint, Freedom::Slide, carrier)?.link;
            (height, carrier) = (Some(found), Some(found));
        }
        if carrier.is_some_and(|link| link != base) {
            return Err(missing_link("base_link (on the last joint of the base)", &parts.base_link));
        }
        let mut arm = Vec::with_capacity(parts.arm_joints.len());
        let mut parent = base;
        for joint in &parts.arm_joints {
            let found = one_axis(articulation, "arm_joints", joint, Freedom::Hinge, Some(parent))?;
            parent = found.link;
            arm.push(found);
        }
        let drives = parts.finger_joints.as_ref().map_or(&[][..], |joints| &joints[..]);
        let x_wrist_mid = match drives.is_empty() {
            true => Pose::identity(),
            false => midway(articulation, &parts.hand_link, &parts.tcp_link, parent)?,
        };
        Ok(Self {
            base_joint,
            height,
            base,
            x_link_base: base_frame.x_link_frame,
            arm: arm.iter().map(|joint| joint.link).collect(),
            arm_axes: arm.iter().map(|joint| joint.axis).collect(),
            arm_limits: arm.iter().map(|joint| joint.limit).collect(),
            fingers: finger::find(articulation, drives, parent, &x_wrist_mid)?,
            bucket: bucket_interior(articulation, parts, base, &base_frame.x_link_frame)?,
        })
    }

    /// Link that carries hand and camera.
    pub fn wrist(&self) -> usize {
        self.arm.last().copied().unwrap_or(self.base)
    }

    /// The finger that a link belongs to.
    pub fn finger_of(&self, link: usize) -> Option<usize> {
        self.fingers.iter().position(|found| found.finger.has(link))
    }
}

/// Pose of a URDF link that must be fixed to the moving link `on`.
pub(crate) fn frame_on(articulation: &Articulation, name: &str, on: usize) -> Result<Pose, RobotError> {
    match articulation.frame(name) {
        Some(frame) if frame.link == Some(on) => Ok(frame.x_link_frame),
        _ => Err(missing_link("config (on the last arm joint)", name)),
    }
}

/// Frame midway between the pads in the frame of the last arm link: at the tool point, turned as the hand.
pub(crate) fn midway(
    articulation: &Articulation,
    hand: &str,
    tool: &str,
    wrist: usize,
) -> Result<Pose, RobotError> {
    let hand = frame_on(articulation, hand, wrist)?;
    let tool = frame_on(articulation, tool, wrist)?;
    Ok(Pose::from_parts(tool.translation, hand.rotation))
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
    parent: Option<usize>,
) -> Result<OneAxis, RobotError> {
    let kind = match freedom {
        Freedom::Hinge => "revolute (on the link before it)",
        Freedom::Slide => "prismatic (on the link before it)",
    };
    let link = articulation
        .link_of_joint(joint)
        .filter(|&l| articulation.links[l].parent == parent)
        .ok_or_else(|| missing_joint(by, kind, joint))?;
    let found = &articulation.links[link];
    if found.limit.is_some_and(|limit| !limit.is_complete()) {
        let problem = "a joint that is driven needs limits of position, velocity and effort (--limits FILE)";
        return Err(RobotError::Limit { joint: joint.to_owned(), problem });
    }
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

/// Joint of the base: the config names it, and it is the first of the robot.
fn base_joint(
    articulation: &Articulation,
    parts: &Parts,
    base_frame: &Frame,
) -> Result<BaseJoint<usize>, RobotError> {
    let Some(name) = &parts.base_joint else { return Ok(BaseJoint::Fixed) };
    let link = articulation.link_of_joint(name).filter(|&l| articulation.links[l].parent.is_none());
    match link.map(|l| (l, articulation.links[l].joint)) {
        Some((l, JointKind::Planar)) => Ok(BaseJoint::Planar(l)),
        Some((on, JointKind::Slide(axis))) => {
            let axis_base = base_frame.x_link_frame.rotation.inverse() * axis.into_inner();
            if axis_base.z.abs() > LEVEL {
                return Err(RobotError::Axis {
                    joint: name.clone(),
                    axis: format!("{:?}", axis.as_slice()),
                    problem: "of a rail is not level",
                });
            }
            Ok(BaseJoint::Rail { on, axis_base })
        }
        _ => Err(missing_joint("base_joint", "planar or prismatic (on the root link)", name)),
    }
}

/// Largest vertical part of a rail's direction, above the rounding of printed numbers \[1\].
const LEVEL: f64 = 1e-6;

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
