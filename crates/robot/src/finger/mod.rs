//! Fingers: the joint that drives each, the links that follow it, and the opening in metres.
//!
//! A finger is driven by one joint on the last arm link. Links that mimic it, or that it mimics, move with it in a fixed ratio. Its opening s \[m\] is the
//! position of a sliding joint; for a hinge it is the distance of the pad from the plane midway between the pads, a function s(q) of the joint's
//! position that is measured on the description's shapes when the robot is read. By virtual work a force F at the pad is a torque `F ds/dq` of the
//! joint.

mod curve;
mod find;

pub(crate) use find::find;

use crate::articulation::{Limit, moved_by};
pub use curve::Curve;
use orchard_geometry::Pose;
use orchard_multibody::{JointKind, SpatialInertia};

/// A finger; `T` identifies its links or bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Finger<T> {
    /// Link or body of the driving joint, which is on the last arm link.
    pub drive: T,
    /// All links or bodies that move with the driving joint, itself first.
    pub links: Vec<FingerLink<T>>,
    /// Opening by the position of the driving joint.
    pub opening: Opening,
}

/// A link of a finger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerLink<T> {
    /// The link or body.
    pub on: T,
    /// Position of its joint per position of the driving joint.
    pub ratio: f64,
}

impl<T: Copy + PartialEq> Finger<T> {
    /// Returns the finger with another identification of its links or bodies.
    pub fn map<U>(&self, on: impl Fn(T) -> U) -> Finger<U> {
        let links = self.links.iter().map(|link| FingerLink { on: on(link.on), ratio: link.ratio });
        Finger { drive: on(self.drive), links: links.collect(), opening: self.opening.clone() }
    }

    /// True if a link or body belongs to the finger.
    pub fn has(&self, link: T) -> bool {
        self.links.iter().any(|own| own.on == link)
    }
}

/// Opening of a finger \[m\] by the position of its driving joint [rad or m].
#[derive(Debug, Clone, PartialEq)]
pub enum Opening {
    /// The joint slides: its position is the opening.
    Slide,
    /// The joint turns.
    Turn(Box<Turn>),
}

/// Opening of a finger on a hinge.
#[derive(Debug, Clone, PartialEq)]
pub struct Turn {
    /// Opening by the joint's position, over the joint's range.
    pub opening: Curve,
    /// The joint's position by the opening.
    joint: Curve,
}

impl Opening {
    /// Opening at a position of the driving joint \[m\]; beyond the joint's range the curve goes on straight.
    pub fn at(&self, q: f64) -> f64 {
        match self {
            Self::Slide => q,
            Self::Turn(turn) => turn.opening.at(q),
        }
    }

    /// Change of the opening per change of the driving joint's position [m/rad, or 1].
    pub fn rate(&self, q: f64) -> f64 {
        match self {
            Self::Slide => 1.0,
            Self::Turn(turn) => turn.opening.slope(q),
        }
    }

    /// Position of the driving joint towards which a spring pulls it from `q` if a spring at the pad has its rest at `target` \[m\]: exact for a joint
    /// that slides, linear about `q` for one that turns, so that the efforts at `q` agree.
    pub(crate) fn rest(&self, q: f64, target: f64) -> f64 {
        match self {
            Self::Slide => target,
            Self::Turn(_) => q + (target - self.at(q)) / self.rate(q),
        }
    }

    /// Position of the driving joint at an opening [rad or m].
    pub fn joint(&self, opening: f64) -> f64 {
        match self {
            Self::Slide => opening,
            Self::Turn(turn) => turn.joint.at(opening),
        }
    }
}

/// A finger of a description, with its figures in metres and newtons.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FoundFinger {
    pub finger: Finger<usize>,
    /// Openings \[m\], largest speed of the opening [m/s] and largest force at the pad \[N\] over the whole range.
    pub limit: Limit,
    /// Inertia that the driving joint moves, in the middle of its range [kg m^2 or kg].
    pub inertia: f64,
    /// Mean of |ds/dq|: lever of the pad about the driving joint \[m\]; 1 for a joint that slides.
    pub lever: f64,
    /// Joints from the last arm link to each link of the finger.
    pub chains: Vec<Vec<ChainJoint>>,
}

/// A joint on the way from the last arm link to a link of a finger.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ChainJoint {
    pub x_parent_joint: Pose,
    pub joint: JointKind,
    /// Position of the joint per position of the driving joint.
    pub ratio: f64,
    /// Inertia of the link that it carries, in the link's frame.
    pub inertia: SpatialInertia,
}

/// Pose of the end of a chain in the frame of the last arm link, with the driving joint at `q`.
pub(crate) fn chain_pose(chain: &[ChainJoint], q: f64) -> Pose {
    let Some((first, others)) = chain.split_first() else { return Pose::identity() };
    // No product with the identity, so that the first joint keeps its bits.
    joined(first.x_parent_joint * moved_by(&first.joint, first.ratio * q), others, q)
}

/// Pose of the end of a chain that begins in the frame `x`, with the driving joint at `q`.
pub(crate) fn joined(x: Pose, chain: &[ChainJoint], q: f64) -> Pose {
    chain.iter().fold(x, |x, joint| x * joint.x_parent_joint * moved_by(&joint.joint, joint.ratio * q))
}
