//! Indices of a robot's parts in a world's model.

use crate::base::BaseJoint;
use crate::cup::Cup;
use crate::finger::Finger;
use crate::joint_values::MAX_ARM_DOF;
use orchard_geometry::{Pose, Vec3};
use orchard_multibody::{BodyId, ColliderId, Data, Groups};

/// Collision groups of the robot's parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PartGroups {
    /// Chassis.
    pub base: Groups,
    /// Arm and hand.
    pub arm: Groups,
    /// Fingers.
    pub finger: Groups,
    /// Bucket.
    pub bucket: Groups,
    /// Lowest of nine neighbouring group bits for contacts between the robot's own links, one for the base and one for each link of the
    /// arm; `None` switches these contacts off.
    pub self_contact: Option<u32>,
}

impl PartGroups {
    /// Groups of a collider of part `groups` on the link after `rank` arm joints; `watches` lists the links that it must not pass
    /// through.
    pub(crate) fn on_link(&self, groups: Groups, rank: usize, watches: impl Fn(usize) -> bool) -> Groups {
        let Some(lowest) = self.self_contact else { return groups };
        let bit = |rank: usize| 1_u32.checked_shl(lowest + rank as u32).unwrap_or(0);
        let others = (0..=MAX_ARM_DOF).filter(|&other| watches(other)).map(bit);
        Groups {
            member: groups.member | bit(rank),
            filter: others.fold(groups.filter, |filter, other| filter | other),
        }
    }
}

/// Colliders of the robot by part.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RobotColliders {
    /// Chassis.
    pub base: Vec<ColliderId>,
    /// Arm and hand.
    pub arm: Vec<ColliderId>,
    /// Left finger, right finger.
    pub fingers: [Vec<ColliderId>; 2],
    /// Bucket floor and walls.
    pub bucket: Vec<ColliderId>,
    /// Points of a suction cup's lip.
    pub cup: Vec<ColliderId>,
}

/// Interior of the bucket: a box in the base frame, open at the top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bucket {
    /// Centre \[m\], base frame.
    pub p_base: Vec3,
    /// Half-extents of the interior \[m\].
    pub half: Vec3,
}

impl Bucket {
    /// True if a point of the base frame lies in the bucket.
    pub fn contains(&self, p_base: &Vec3) -> bool {
        let d = (p_base - self.p_base).abs();
        (0..3).all(|k| d[k] <= self.half[k])
    }

    /// True if a point of the base frame lies in the bucket, or above or below it.
    pub fn covers(&self, p_base: &Vec3) -> bool {
        let d = (p_base - self.p_base).abs();
        (0..2).all(|k| d[k] <= self.half[k])
    }
}

/// Bodies, colliders and frames of a robot in a world's model. The joint of a body is at `model.qs(body)` in q and at `model.dofs(body)` in
/// v.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotHandle {
    /// Bodies in the order of the articulation's links.
    pub bodies: Vec<BodyId>,
    /// Joint by which the base moves.
    pub base_joint: BaseJoint<BodyId>,
    /// Body of the height joint.
    pub height: Option<BodyId>,
    /// Body that carries the `base` frame.
    pub base: BodyId,
    /// The `base` frame in the frame of body `base`.
    pub x_body_base: Pose,
    /// Bodies of the arm joints; the last one carries hand and camera.
    pub arm: Vec<BodyId>,
    /// The two fingers; none for a hand with a suction cup.
    pub fingers: Vec<Finger<BodyId>>,
    /// Suction cup on the last arm body.
    pub cup: Option<Cup>,
    /// Optical frame of the camera in the frame of the last arm body.
    pub x_wrist_camera: Pose,
    /// Hand frame in the frame of the last arm body.
    pub x_wrist_hand: Pose,
    /// Point between the finger pads in the frame of the last arm body.
    pub x_wrist_tcp: Pose,
    /// Colliders.
    pub colliders: RobotColliders,
    /// Bucket interior.
    pub bucket: Bucket,
}

impl RobotHandle {
    /// Body that carries hand and camera.
    pub fn wrist(&self) -> BodyId {
        self.arm.last().copied().unwrap_or(self.base)
    }

    /// Pose of the camera's optical frame in the world.
    pub fn x_world_camera(&self, data: &Data) -> Pose {
        data.x_world_body(self.wrist()) * self.x_wrist_camera
    }

    /// Pose of the `base` frame in the world.
    pub fn x_world_base(&self, data: &Data) -> Pose {
        data.x_world_body(self.base) * self.x_body_base
    }

    /// Pose of the point between the finger pads in the world.
    pub fn x_world_tcp(&self, data: &Data) -> Pose {
        data.x_world_body(self.wrist()) * self.x_wrist_tcp
    }
}
