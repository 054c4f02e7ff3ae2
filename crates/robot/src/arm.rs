//! Kinematics and statics of the arm in the base frame, for controllers: needs no world.

use crate::articulation::Limit;
use crate::chain::{Chain, LinkPoses};
use crate::cup::Cup;
use crate::finger::{ChainJoint, Opening, joined};
use crate::joint_values::{JointValues, MAX_ARM_DOF};
use crate::parameters::{IkParameters, QpParameters};
use orchard_geometry::{Aabb, Pose, Shape, Vec3};
use orchard_multibody::{SpatialInertia, Wrench};

pub use crate::chain::{BaseMotion, Jacobian};
pub use crate::joint_values::JointVector;

/// Largest number of links: the base and one after each arm joint.
pub(crate) const RANKS: usize = MAX_ARM_DOF + 1;

/// Matrix of the watched pairs of links: `pairs[a][b]` is true if links a and b must not touch; symmetric.
pub(crate) type Pairs = [[bool; RANKS]; RANKS];

/// Forward kinematics, Jacobian, inverse kinematics, gravity torque and shapes of the arm on its base.
///
/// All poses are in the `base` frame: on the ground under the chassis, x forward, y left.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmKinematics {
    pub(crate) chain: Chain,
    /// Upper bound of the distance between the first joint and the joint before the last \[m\] ([`Chain::stretch`]).
    pub(crate) stretch: f64,
    /// Limits of the arm joints.
    pub(crate) limits: [Limit; MAX_ARM_DOF],
    pub(crate) home: JointVector,
    pub(crate) ik: IkParameters,
    pub(crate) mounts: WristMounts,
    pub(crate) cup: Option<Cup>,
    pub(crate) openings: Vec<Opening>,
    pub(crate) finger_stroke: f64,
    pub(crate) finger_speed: f64,
    pub(crate) finger_force: f64,
    pub(crate) shapes: Vec<MountedShape>,
    /// Links that must not touch each other.
    pub(crate) pairs: Pairs,
    pub(crate) qp: QpParameters,
}

/// Poses of hand, TCP and camera in the frame of the arm's last link, to which they are fixed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WristMounts {
    pub x_wrist_hand: Pose,
    pub x_wrist_tcp: Pose,
    pub x_wrist_camera: Pose,
}

/// A shape on the base, on an arm link or on a finger.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MountedShape {
    pub shape: Shape,
    pub mount: Mount,
    pub x_mount_shape: Pose,
    /// Number of arm joints between the base and the shape.
    pub rank: usize,
}

/// Part that a shape is fixed to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Mount {
    Base,
    Arm(usize),
    /// Number of the finger, and the joints from the wrist to the link.
    Finger(usize, Vec<ChainJoint>),
}

impl MountedShape {
    /// Returns the pose of the shape in the base frame, given the poses of the arm's links and the positions of the fingers' driving joints.
    pub fn placed(&self, links: &LinkPoses, drives: &[f64; 2]) -> Pose {
        let x_base_mount = match &self.mount {
            Mount::Base => Pose::identity(),
            Mount::Arm(i) => links[*i],
            Mount::Finger(i, chain) => joined(links[MAX_ARM_DOF - 1], chain, drives[*i]),
        };
        x_base_mount * self.x_mount_shape
    }
}

impl ArmKinematics {
    /// Number of arm joints.
    pub fn dof(&self) -> usize {
        self.chain.dof()
    }

    /// Limits of the arm joints.
    pub fn limits(&self) -> &[Limit] {
        &self.limits[..self.dof()]
    }

    /// The numbers of the arm's joints in a vector.
    pub fn values(&self, vector: &JointVector) -> JointValues {
        JointValues::of(vector, self.dof())
    }

    /// Joint positions at the start of an episode.
    pub fn home(&self) -> JointVector {
        self.home
    }

    /// Position of the first joint's frame, base frame \[m\].
    pub fn shoulder(&self) -> Vec3 {
        self.chain.hinges[0].x_parent_joint.translation.vector
    }

    /// Length of the arm from its second joint to the tool point \[m\]: the sum of the offsets of its joints, as if it could be stretched out.
    pub fn length(&self) -> f64 {
        let offsets =
            self.chain.hinges.iter().skip(2).map(|hinge| hinge.x_parent_joint.translation.vector.norm());
        offsets.sum::<f64>() + self.mounts.x_wrist_tcp.translation.vector.norm()
    }

    /// False if a point (base frame) is farther away than the stretched arm could be long; the joints' limits are left out.
    pub fn may_reach(&self, p_base: &Vec3) -> bool {
        let second = self.chain.hinges[1].x_parent_joint.translation.vector.norm();
        (p_base - self.shoulder()).norm() <= second + self.length()
    }

    /// Distance from the hand's frame to the tool point along the approach \[m\].
    pub fn hand_length(&self) -> f64 {
        -self.x_tcp_hand().translation.z
    }

    /// Box about hand and fingers, wide open, in the tool point's frame: about the shapes on the last arm link whose middles lie beyond the
    /// hand's frame. A point at the origin if there are none.
    pub fn hand_box(&self) -> Aabb {
        let (links, x_hand) = ([Pose::identity(); MAX_ARM_DOF], self.x_tcp_hand());
        let x_tcp_wrist = self.mounts.x_wrist_tcp.inverse();
        let open = [self.finger_stroke; 2];
        let on_hand = self.shapes.iter().filter(|s| s.rank == self.dof());
        let boxes = on_hand.map(|s| s.shape.aabb(&(x_tcp_wrist * s.placed(&links, &open))));
        let beyond = boxes.filter(|b| 0.5 * (b.min.z + b.max.z) > x_hand.translation.z);
        let none = Aabb { min: Vec3::zeros(), max: Vec3::zeros() };
        beyond.reduce(|a, b| a.union(&b)).unwrap_or(none)
    }

    fn x_tcp_hand(&self) -> Pose {
        self.mounts.x_wrist_tcp.inverse() * self.mounts.x_wrist_hand
    }

    /// Load that the hand puts on its surroundings at the TCP, base axes: the least-squares wrench that explains the measured torques [N m] less those
    /// for gravity [m/s2] and for the joint accelerations `a` [rad/s2]. Velocity products and the base's acceleration are left out.
    pub fn tcp_load(&self, q: &JointVector, a: &JointVector, torque: &JointVector, gravity: &Vec3) -> Wrench {
        self.load_of(q, &(torque - self.gravity_torque(q, gravity) - self.inertial_torque(q, a)))
    }

    /// Load that the hand puts on its surroundings at the TCP, base axes, as [`Self::tcp_load`] of an arm on a moving base. The torques for velocity
    /// products and for the motion of the base are taken off as well; `v` are the joint velocities [rad/s].
    pub fn tcp_load_on_moving_base(
        &self,
        q: &JointVector,
        v: &JointVector,
        a: &JointVector,
        torque: &JointVector,
        base: &BaseMotion,
        gravity: &Vec3,
    ) -> Wrench {
        self.load_of(q, &(torque - self.motion_torque(q, v, a, base, gravity)))
    }

    /// Joint torques of a motion on a moving base [N m]: inertia, velocity products, gravity [m/s2] and the base's motion. `v` and `a` are the joint
    /// velocities [rad/s] and accelerations [rad/s2]; all vectors are in base axes.
    pub fn motion_torque(
        &self,
        q: &JointVector,
        v: &JointVector,
        a: &JointVector,
        base: &BaseMotion,
        gravity: &Vec3,
    ) -> JointVector {
        self.chain.motion_torque(q, v, a, base, gravity)
    }

    /// Least-squares wrench at the TCP that explains joint torques [N m]; none where the arm is singular.
    fn load_of(&self, q: &JointVector, torque: &JointVector) -> Wrench {
        let jacobian = self.jacobian(q);
        let gram = jacobian * jacobian.transpose();
        let Some(factor) = gram.cholesky() else { return Wrench::ZERO };
        let wrench = factor.solve(&(jacobian * torque));
        let part = |row| Vec3::new(wrench[row], wrench[row + 1], wrench[row + 2]);
        Wrench { torque: part(0), force: part(3) }
    }

    /// The suction cup; `None` for a hand with fingers.
    pub fn cup(&self) -> Option<&Cup> {
        self.cup.as_ref()
    }

    /// Largest opening of each finger \[m\].
    pub fn finger_stroke(&self) -> f64 {
        self.finger_stroke
    }

    /// Largest speed of each finger [m/s].
    pub fn finger_speed(&self) -> f64 {
        self.finger_speed
    }

    /// Largest force of each finger drive \[N\].
    pub fn finger_force(&self) -> f64 {
        self.finger_force
    }

    /// Joint positions, clamped to the joint limits.
    pub fn clamped(&self, q: &JointVector) -> JointVector {
        JointVector::from_fn(|i, _| q[i].clamp(self.limits[i].lower, self.limits[i].upper))
    }

    fn wrist(&self, q: &JointVector) -> Pose {
        self.chain.link_poses(q)[MAX_ARM_DOF - 1]
    }

    /// Pose of the point between the finger pads (z the approach axis, y the fingers' direction).
    pub fn tcp(&self, q: &JointVector) -> Pose {
        self.wrist(q) * self.mounts.x_wrist_tcp
    }

    /// Pose of the camera's optical frame.
    pub fn camera(&self, q: &JointVector) -> Pose {
        self.wrist(q) * self.mounts.x_wrist_camera
    }

    /// Pose of the optical frame in the TCP's frame.
    pub fn x_tcp_camera(&self) -> Pose {
        self.mounts.x_wrist_tcp.inverse() * self.mounts.x_wrist_camera
    }

    /// TCP pose and its Jacobian: angular rows first, linear rows second, base axes.
    pub fn tcp_and_jacobian(&self, q: &JointVector) -> (Pose, Jacobian) {
        let links = self.chain.link_poses(q);
        let x_tcp = links[MAX_ARM_DOF - 1] * self.mounts.x_wrist_tcp;
        (x_tcp, self.chain.jacobian(&links, &x_tcp.translation.vector))
    }

    /// Jacobian of the TCP: angular rows first, linear rows second, base axes.
    pub fn jacobian(&self, q: &JointVector) -> Jacobian {
        self.tcp_and_jacobian(q).1
    }

    /// Joint torques [N m] that hold the arm still under `gravity` [m/s2], base axes.
    pub fn gravity_torque(&self, q: &JointVector, gravity: &Vec3) -> JointVector {
        self.chain.gravity_torque(q, gravity)
    }

    /// Joint torques [N m] that accelerate the arm from rest by `a` [rad/s2].
    pub fn inertial_torque(&self, q: &JointVector, a: &JointVector) -> JointVector {
        self.chain.inertial_torque(q, a)
    }

    /// Inertia of the last arm link with hand and fingers, at their start opening, in the link's frame: what the servos take it for.
    pub fn wrist_inertia(&self) -> SpatialInertia {
        self.chain.hinges[self.dof() - 1].inertia
    }

    /// Inertia that each joint moves with all other joints locked [kg m^2].
    pub fn reflected_inertia(&self, q: &JointVector) -> JointVector {
        self.chain.reflected_inertia(q)
    }

    /// All collision shapes of the robot with their poses, fingers opened by `finger_q` \[m\].
    pub fn link_shapes(&self, q: &JointVector, finger_q: &[f64; 2]) -> Vec<(Shape, Pose)> {
        let links = self.chain.link_poses(q);
        let drives = self.finger_joints(finger_q);
        let place = |s: &MountedShape| (s.shape.clone(), s.placed(&links, &drives));
        self.shapes.iter().map(place).collect()
    }

    /// Positions of the fingers' driving joints at openings \[m\].
    pub(crate) fn finger_joints(&self, finger_q: &[f64; 2]) -> [f64; 2] {
        std::array::from_fn(|i| {
            self.openings.get(i).map_or(finger_q[i], |opening| opening.joint(finger_q[i]))
        })
    }
}
