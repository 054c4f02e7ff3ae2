//! Parts of an articulation: moving links, shapes, frames, limits.

use orchard_geometry::{Pose, Shape};
use orchard_multibody::{JointKind, SpatialInertia};

/// Limits of a joint with one degree of freedom. A limit that neither the description nor a limits file gives is infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// Lowest position [rad or m].
    pub lower: f64,
    /// Highest position [rad or m].
    pub upper: f64,
    /// Largest speed [rad/s or m/s].
    pub velocity: f64,
    /// Largest torque or force [N m or N].
    pub effort: f64,
}

impl Limit {
    /// Limits of a joint that stands at 0.
    pub(crate) const LOCKED: Self = Self { lower: 0.0, upper: 0.0, velocity: 0.0, effort: 0.0 };

    /// No limits.
    pub const NONE: Limit = Limit {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        velocity: f64::INFINITY,
        effort: f64::INFINITY,
    };

    /// True if all four limits are given, as a joint that a controller drives needs.
    pub fn is_complete(&self) -> bool {
        [self.lower, self.upper, self.velocity, self.effort].iter().all(|x| x.is_finite())
    }
}

/// Friction of a joint with one degree of freedom.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Friction {
    /// Coulomb friction [N m or N].
    pub coulomb: f64,
    /// Viscous friction [N m s/rad or N s/m].
    pub viscous: f64,
}

/// Coupling of a joint to another: q = multiplier * q of the leader. An offset of the description is part of the placement, so that the
/// follower's q counts from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mimic {
    /// Link of the leading joint.
    pub leader: usize,
    /// Ratio.
    pub multiplier: f64,
}

/// A collision shape of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkShape {
    /// Name of the URDF link that the shape belongs to.
    pub part: String,
    /// Shape.
    pub shape: Shape,
    /// Pose of the shape in the frame of the moving link.
    pub x_link_shape: Pose,
}

/// A moving link with the joint that carries it.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Name of the URDF link at the joint.
    pub name: String,
    /// Name of the joint.
    pub joint_name: String,
    /// Moving link that carries this one; `None` is the ground.
    pub parent: Option<usize>,
    /// The joint.
    pub joint: JointKind,
    /// Pose of the joint frame in the parent's frame.
    pub x_parent_joint: Pose,
    /// Inertia of all URDF links that this moving link joins.
    pub inertia: SpatialInertia,
    /// Collision shapes.
    pub shapes: Vec<LinkShape>,
    /// Limits, for hinges and slides.
    pub limit: Option<Limit>,
    /// Friction in the description.
    pub friction: Friction,
    /// Coupling to another joint.
    pub mimic: Option<Mimic>,
}

/// The frame of a URDF link.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Name of the URDF link.
    pub name: String,
    /// Moving link that carries this one; `None` is the ground.
    pub link: Option<usize>,
    /// Pose in the frame of that link.
    pub x_link_frame: Pose,
}

/// A robot as moving links, parents before children.
#[derive(Debug, Clone, PartialEq)]
pub struct Articulation {
    /// The robot's name.
    pub name: String,
    /// Moving links, parents before children.
    pub links: Vec<Link>,
    /// Frames of all URDF links.
    pub frames: Vec<Frame>,
}

impl Articulation {
    /// The frame of a URDF link.
    pub fn frame(&self, name: &str) -> Option<&Frame> {
        self.frames.iter().find(|f| f.name == name)
    }

    /// Index of the moving link that a joint carries.
    pub fn link_of_joint(&self, joint: &str) -> Option<usize> {
        self.links.iter().position(|l| l.joint_name == joint)
    }

    /// Link that leads a link's joint, through all joints in between, and the ratio to it: the link itself and 1 if it mimics nothing.
    pub(crate) fn lead(&self, link: usize) -> (usize, f64) {
        let (mut at, mut ratio) = (link, 1.0);
        while let Some(mimic) = self.links[at].mimic {
            at = mimic.leader;
            ratio *= mimic.multiplier;
        }
        (at, ratio)
    }

    /// Poses of the moving links in the frame of the root at q = 0.
    pub fn poses_at_zero(&self) -> Vec<Pose> {
        let mut x_root_links: Vec<Pose> = Vec::with_capacity(self.links.len());
        for link in &self.links {
            let x_parent = link.parent.map_or(Pose::identity(), |p| x_root_links[p]);
            x_root_links.push(x_parent * link.x_parent_joint);
        }
        x_root_links
    }
}
