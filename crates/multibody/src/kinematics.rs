//! Forward kinematics: poses, joint axes, velocities and bias accelerations, root to tips.

use orchard_geometry::{Pose, Rotation, Vec3, math};

use crate::data::Data;
use crate::model::{JointKind, Model};
use crate::spatial::Twist;
use crate::symmetric::Symmetric3;

/// What a state implies for one link. World axes, at the link's origin.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    /// Pose of the link.
    pub x_world_body: Pose,
    /// From the parent's origin (the world's for a root) to this origin [m].
    pub r_parent: Vec3,
    /// From the origin to the centre of mass [m].
    pub r_com: Vec3,
    /// Inertia about the centre of mass [kg m^2].
    pub i_com: Symmetric3,
    /// Velocity.
    pub velocity: Twist,
    /// Acceleration of the link at its origin with all joint accelerations zero [rad/s^2, m/s^2].
    pub bias_acceleration: Twist,
}

impl Link {
    pub fn origin(&self) -> &Vec3 {
        &self.x_world_body.translation.vector
    }
}

/// Kinematics of all links, and the state that they belong to.
#[derive(Debug, Clone)]
pub(crate) struct Kinematics {
    pub links: Vec<Link>,
    /// Axis of each degree of freedom, world.
    pub axes: Vec<Vec3>,
    q: Vec<f64>,
    v: Vec<f64>,
}

impl Kinematics {
    pub fn new(model: &Model) -> Kinematics {
        let link = Link {
            x_world_body: Pose::identity(),
            r_parent: Vec3::zeros(),
            r_com: Vec3::zeros(),
            i_com: Symmetric3::ZERO,
            velocity: Twist::ZERO,
            bias_acceleration: Twist::ZERO,
        };
        Kinematics {
            links: vec![link; model.bodies.len()],
            axes: vec![Vec3::zeros(); model.nv()],
            q: vec![f64::NAN; model.nq()],
            v: vec![f64::NAN; model.nv()],
        }
    }
}

/// Motion of a link relative to its parent.
struct JointMotion {
    /// Rotation of the link in the joint frame.
    rotation: Rotation,
    /// From the joint frame's origin to the link's origin, world axes.
    translation: Vec3,
    /// Velocity relative to the parent at the link's origin, world axes.
    velocity: Twist,
    /// Part of the angular bias acceleration that the joint makes by itself: the second axis of a universal
    /// joint turns with the first.
    bias_angular: Vec3,
}

/// Brings poses, axes, velocities and bias accelerations up to `Data::q` and `Data::v`.
///
/// Returns at once if they are so already. Afterwards the accessors of [`Data`] that name kinematics hold.
pub fn forward_kinematics(model: &Model, data: &mut Data) {
    let kinematics = &mut data.kinematics;
    if same_bits(&kinematics.q, &data.q) && same_bits(&kinematics.v, &data.v) {
        return;
    }
    kinematics.q.copy_from_slice(&data.q);
    kinematics.v.copy_from_slice(&data.v);
    for (index, body) in model.bodies.iter().enumerate() {
        let (x_world_parent, parent_velocity, parent_bias) = match body.parent {
            Some(parent) => {
                let link = &kinematics.links[parent.index()];
                (link.x_world_body, link.velocity, link.bias_acceleration)
            }
            None => (Pose::identity(), Twist::ZERO, Twist::ZERO),
        };
        let joint_arm = x_world_parent.rotation * body.x_parent_joint.translation.vector;
        let frame = x_world_parent.rotation * body.x_parent_joint.rotation;
        let motion = joint_motion(
            &body.joint,
            &frame,
            &data.q[model.q_start[index]..model.q_start[index + 1]],
            &data.v[model.v_start[index]..model.v_start[index + 1]],
            &mut kinematics.axes[model.v_start[index]..model.v_start[index + 1]],
        );
        let rotation = frame * motion.rotation;
        let r_parent = joint_arm + motion.translation;
        let origin = x_world_parent.translation.vector + r_parent;

        // d/dt of the velocity recursion below with constant joint velocities; the joint's axes turn with
        // the parent, which gives the cross products with the parent's angular velocity.
        let omega = parent_velocity.angular;
        let bias_acceleration = Twist {
            angular: parent_bias.angular + omega.cross(&motion.velocity.angular) + motion.bias_angular,
            linear: parent_bias.linear_at(&r_parent)
                + omega.cross(&(omega.cross(&r_parent) + motion.velocity.linear * 2.0)),
        };
        let turn = rotation.to_rotation_matrix();
        kinematics.links[index] = Link {
            x_world_body: Pose::from_parts(origin.into(), rotation),
            r_parent,
            r_com: turn * body.inertia.p_com,
            i_com: Symmetric3::rotated(&body.inertia.i_com, turn.matrix()),
            velocity: parent_velocity.shifted(&r_parent) + motion.velocity,
            bias_acceleration,
        };
    }
}

/// Whether two states are the same to the bits: 0 and -0 are equal, but give zeros of other signs.
fn same_bits(one: &[f64], other: &[f64]) -> bool {
    one.iter().zip(other).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Rotation about a unit axis.
fn rotation_about(axis: &Vec3, angle: f64) -> Rotation {
    let (s, c) = math::sin_cos(0.5 * angle);
    Rotation::new_unchecked(nalgebra::Quaternion::from_parts(c, axis * s))
}

/// Rotation by the vector `angle * axis`.
pub(crate) fn rotation_by(vector: &Vec3) -> Rotation {
    let angle = vector.norm();
    if angle == 0.0 { Rotation::identity() } else { rotation_about(&(vector / angle), angle) }
}

/// Motion of a joint whose frame has the rotation `frame` in the world; fills the joint's axes.
fn joint_motion(joint: &JointKind, frame: &Rotation, q: &[f64], v: &[f64], axes: &mut [Vec3]) -> JointMotion {
    let mut motion = JointMotion {
        rotation: Rotation::identity(),
        translation: Vec3::zeros(),
        velocity: Twist::ZERO,
        bias_angular: Vec3::zeros(),
    };
    match joint {
        JointKind::Weld => {}
        JointKind::Hinge(axis) => {
            axes[0] = frame * axis.into_inner();
            motion.rotation = rotation_about(axis, q[0]);
            motion.velocity.angular = axes[0] * v[0];
        }
        JointKind::Slide(axis) => {
            axes[0] = frame * axis.into_inner();
            motion.translation = axes[0] * q[0];
            motion.velocity.linear = axes[0] * v[0];
        }
        JointKind::Universal => {
            let [x, y, z] = columns(frame);
            let ((s_x, c_x), (s_y, c_y)) = (math::sin_cos(0.5 * q[0]), math::sin_cos(0.5 * q[1]));
            axes[0] = x;
            axes[1] = y * (c_x * c_x - s_x * s_x) + z * (2.0 * s_x * c_x);
            // The product of the two rotations about x and y.
            let product = nalgebra::Quaternion::new(c_x * c_y, s_x * c_y, c_x * s_y, s_x * s_y);
            motion.rotation = Rotation::new_unchecked(product);
            motion.velocity.angular = axes[0] * v[0] + axes[1] * v[1];
            motion.bias_angular = axes[0].cross(&axes[1]) * (v[0] * v[1]);
        }
        JointKind::Planar => {
            axes.copy_from_slice(&columns(frame));
            motion.rotation = rotation_about(&Vec3::z(), q[2]);
            motion.translation = axes[0] * q[0] + axes[1] * q[1];
            motion.velocity = Twist { angular: axes[2] * v[2], linear: axes[0] * v[0] + axes[1] * v[1] };
        }
        JointKind::Free => {
            let [x, y, z] = columns(frame);
            axes.copy_from_slice(&[x, y, z, x, y, z]);
            let along = |c: &[f64]| x * c[0] + y * c[1] + z * c[2];
            motion.rotation = Rotation::from_quaternion(nalgebra::Quaternion::new(q[6], q[3], q[4], q[5]));
            motion.translation = along(&q[..3]);
            motion.velocity = Twist { angular: along(&v[3..]), linear: along(&v[..3]) };
        }
    }
    motion
}

/// The axes of a frame.
fn columns(frame: &Rotation) -> [Vec3; 3] {
    let turn = frame.to_rotation_matrix().into_inner();
    [turn.column(0).into_owned(), turn.column(1).into_owned(), turn.column(2).into_owned()]
}
