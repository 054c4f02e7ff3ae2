//! Parts of a model: links with their joints, tethered point bodies, couplings, colliders.

use nalgebra::Unit;
use orchard_geometry::{Mat3, Pose, Shape, Vec3};
use serde::{Deserialize, Serialize};

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub struct $name(pub u32);

        impl $name {
            /// As an index into the arrays of `Model` and `Data`.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

id!(
    /// A link of the articulation.
    BodyId
);
id!(
    /// A point body (a mass with three translations).
    PointId
);
id!(
    /// A collision shape.
    ColliderId
);

/// Freedom of a joint. Axes are in the joint frame, which is the body frame at q = 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum JointKind {
    /// No freedom.
    Weld,
    /// Rotation about an axis. q: \[rad\].
    Hinge(Unit<Vec3>),
    /// Translation along an axis. q: \[m\].
    Slide(Unit<Vec3>),
    /// Rotation about x, then about the turned y: a bending joint. q: [rad, rad].
    Universal,
    /// Rotation about any axis: a rod along z that bends and twists. q: quaternion (x, y, z, w); v: angular velocity relative to the
    /// parent [rad/s], in the link's axes. Its spring is that of [`crate::Deflection`]: the first two degrees of freedom hold the
    /// bending stiffness, which must be the same, the third the twisting stiffness; the rest pose is q = identity.
    Ball,
    /// x, y, then yaw about z. q: [m, m, rad].
    Planar,
    /// Free in space. q: position \[m\] (3) and quaternion (x, y, z, w) (4); v: linear velocity of the body
    /// origin [m/s] (3) and angular velocity [rad/s] (3), both relative to the parent and in the axes of
    /// the joint frame (world axes where the parent is the world and the placement does not turn).
    Free,
}

impl JointKind {
    /// Degrees of freedom: entries of v.
    pub fn nv(&self) -> usize {
        self.translations() + self.rotations()
    }

    /// Coordinates: entries of q.
    pub fn nq(&self) -> usize {
        match self {
            JointKind::Free => 7,
            JointKind::Ball => 4,
            _ => self.nv(),
        }
    }

    /// True if q holds the joint's rotation as a quaternion, in its last four coordinates.
    pub fn has_quaternion(&self) -> bool {
        matches!(self, JointKind::Ball | JointKind::Free)
    }

    /// Degrees of freedom that are translations; they come before the rotations.
    pub fn translations(&self) -> usize {
        match self {
            JointKind::Weld | JointKind::Hinge(_) | JointKind::Universal | JointKind::Ball => 0,
            JointKind::Slide(_) => 1,
            JointKind::Planar => 2,
            JointKind::Free => 3,
        }
    }

    /// Degrees of freedom that are rotations.
    pub fn rotations(&self) -> usize {
        match self {
            JointKind::Weld | JointKind::Slide(_) => 0,
            JointKind::Hinge(_) | JointKind::Planar => 1,
            JointKind::Universal => 2,
            JointKind::Ball | JointKind::Free => 3,
        }
    }
}

/// Mass, centre of mass and rotational inertia of a link, in its body frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SpatialInertia {
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass \[m\], body frame.
    pub p_com: Vec3,
    /// Inertia about the centre of mass [kg m^2], body axes.
    pub i_com: Mat3,
}

/// A link and the joint that holds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Body {
    /// Parent link; `None` is the world.
    pub parent: Option<BodyId>,
    /// The joint.
    pub joint: JointKind,
    /// Pose of the joint frame in the parent's body frame.
    pub x_parent_joint: Pose,
    /// Inertia.
    pub inertia: SpatialInertia,
}

/// A ball with three translational degrees of freedom in world axes: a fruit. Off its tether it also spins,
/// so that what turns it (a hand, the ground) does not have to slide over it.
///
/// While tethered, a spring-damper pulls it to its hang point; the pull loads the anchor's link within the
/// same linear solve (the point is eliminated as a leaf). Untethered it is a free mass, with no model edit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointBody {
    /// Mass \[kg\].
    pub mass: f64,
    /// Rotational inertia about any axis through its centre [kg m^2]; infinite for a point that never spins.
    pub spin_inertia: f64,
    /// Tether; `None` if it never has one.
    pub tether: Option<Tether>,
}

/// Spring-damper between a point body and a point of a link.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tether {
    /// Link that carries the anchor.
    pub body: BodyId,
    /// Anchor in the link's body frame \[m\].
    pub p_body: Vec3,
    /// Hang point minus anchor, in world axes \[m\].
    pub offset_world: Vec3,
    /// Stiffness [N/m].
    pub stiffness: f64,
    /// Damping [N s/m].
    pub damping: f64,
    /// Constant force added on the anchor while tethered \[N\], world, at reset (the paper takes the fruit's weight
    /// off); `Data::anchor_bias_world` may change it.
    pub anchor_bias_world: Vec3,
    /// Largest net reaction on the anchor \[N\], at reset; the excess is dropped. Infinite: no cap.
    /// `Data::reaction_cap` may change it.
    pub reaction_cap: f64,
    /// True if the point body turns with the link while tethered: the link then holds its rotational inertia, and what turns the
    /// ball turns the link. False for a point on a string, which nothing turns.
    pub turns: bool,
}

/// A linear relation held by a stiff spring-damper: `q[dof_a] = ratio * q[dof_b]` (coupled gripper fingers).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Coupling {
    /// First degree of freedom (index into v).
    pub dof_a: usize,
    /// Second degree of freedom.
    pub dof_b: usize,
    /// Ratio.
    pub ratio: f64,
    /// Stiffness [N/m or N m/rad].
    pub stiffness: f64,
    /// Damping [N s/m or N m s/rad].
    pub damping: f64,
}

/// Owner of a collider: it moves with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    /// The world.
    World,
    /// A link.
    Body(BodyId),
    /// A point body.
    Point(PointId),
}

/// Collision groups as bit masks: a pair may touch if each one's `filter` holds a bit of the other's `member`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Groups {
    /// Groups it belongs to.
    pub member: u32,
    /// Groups it may touch.
    pub filter: u32,
}

impl Groups {
    /// Groups of a collider that touches no other.
    pub const NONE: Groups = Groups { member: 0, filter: 0 };

    /// True if two colliders may touch.
    pub fn may_touch(self, other: Groups) -> bool {
        self.filter & other.member != 0 && other.filter & self.member != 0
    }
}

/// A collision shape. Its groups may change at run time in `Data::groups`.
#[derive(Debug, Clone, PartialEq)]
pub struct Collider {
    /// Body that it moves with.
    pub owner: Owner,
    /// Shape.
    pub shape: Shape,
    /// Pose of the shape in its owner's frame.
    pub x_owner_shape: Pose,
    /// Groups at reset.
    pub groups: Groups,
    /// Coulomb coefficient; a pair takes the geometric mean of its two.
    pub friction: f64,
    /// Stiffness of its surface [N/m]; the two of a pair act in series. Infinite: rigid.
    pub stiffness: f64,
}
