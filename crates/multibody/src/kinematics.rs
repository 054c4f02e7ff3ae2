//! Forward kinematics: poses, joint axes, velocities and bias accelerations, root to tips.

use nalgebra::Translation3;
use orchard_geometry::{Mat3, Pose, Rotation, Vec3, math};

use crate::data::Data;
use crate::model::{JointKind, Model};
use crate::spatial::Twist;

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
    pub i_com: Mat3,
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
            i_com: Mat3::zeros(),
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

/// Motion of a link relative to its parent: pose of the body in the joint frame and velocity in world axes.
struct JointMotion {
    x_joint_body: Pose,
    /// Velocity relative to the parent at the link's origin.
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
    if kinematics.q == data.q && kinematics.v == data.v {
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
        let x_world_joint = x_world_parent * body.x_parent_joint;
        let motion = joint_motion(
            &body.joint,
            &x_world_joint,
            &data.q[model.q_start[index]..model.q_start[index + 1]],
            &data.v[model.v_start[index]..model.v_start[index + 1]],
            &mut kinematics.axes[model.v_start[index]..model.v_start[index + 1]],
        );
        let x_world_body = x_world_joint * motion.x_joint_body;
        let r_parent = x_world_body.translation.vector - x_world_parent.translation.vector;

        // d/dt of the velocity recursion below with constant joint velocities; the joint's axes turn with
        // the parent, which gives the cross products with the parent's angular velocity.
        let omega = parent_velocity.angular;
        let bias_acceleration = Twist {
            angular: parent_bias.angular + omega.cross(&motion.velocity.angular) + motion.bias_angular,
            linear: parent_bias.linear_at(&r_parent)
                + omega.cross(&(omega.cross(&r_parent) + motion.velocity.linear * 2.0)),
        };
        let rotation = x_world_body.rotation.to_rotation_matrix();
        let r_com = rotation * body.inertia.p_com;
        let i_com = rotation.matrix() * body.inertia.i_com * rotation.matrix().transpose();
        kinematics.links[index] = Link {
            x_world_body,
            r_parent,
            r_com,
            i_com,
            velocity: parent_velocity.shifted(&r_parent) + motion.velocity,
            bias_acceleration,
        };
    }
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

fn joint_motion(
    joint: &JointKind,
    x_world_joint: &Pose,
    q: &[f64],
    v: &[f64],
    axes: &mut [Vec3],
) -> JointMotion {
    let frame = &x_world_joint.rotation;
    let mut motion =
        JointMotion { x_joint_body: Pose::identity(), velocity: Twist::ZERO, bias_angular: Vec3::zeros() };
    match joint {
        JointKind::Weld => {}
        JointKind::Hinge(axis) => {
            axes[0] = frame * axis.into_inner();
            motion.x_joint_body.rotation = rotation_about(axis, q[0]);
            motion.velocity.angular = axes[0] * v[0];
        }
        JointKind::Slide(axis) => {
            axes[0] = frame * axis.into_inner();
            motion.x_joint_body.translation.vector = axis.into_inner() * q[0];
            motion.velocity.linear = axes[0] * v[0];
        }
        JointKind::Universal => {
            let about_x = rotation_about(&Vec3::x(), q[0]);
            axes[0] = frame * Vec3::x();
            axes[1] = frame * (about_x * Vec3::y());
            motion.x_joint_body.rotation = about_x * rotation_about(&Vec3::y(), q[1]);
            motion.velocity.angular = axes[0] * v[0] + axes[1] * v[1];
            motion.bias_angular = axes[0].cross(&axes[1]) * (v[0] * v[1]);
        }
        JointKind::Planar => {
            let turn = frame.to_rotation_matrix();
            for k in 0..3 {
                axes[k] = turn.matrix().column(k).into_owned();
            }
            motion.x_joint_body =
                Pose::from_parts(Translation3::new(q[0], q[1], 0.0), rotation_about(&Vec3::z(), q[2]));
            motion.velocity = Twist { angular: axes[2] * v[2], linear: axes[0] * v[0] + axes[1] * v[1] };
        }
        JointKind::Free => {
            let turn = frame.to_rotation_matrix();
            for k in 0..3 {
                axes[k] = turn.matrix().column(k).into_owned();
                axes[3 + k] = axes[k];
            }
            let rotation = Rotation::from_quaternion(nalgebra::Quaternion::new(q[6], q[3], q[4], q[5]));
            motion.x_joint_body = Pose::from_parts(Translation3::new(q[0], q[1], q[2]), rotation);
            motion.velocity = Twist {
                angular: turn * Vec3::new(v[3], v[4], v[5]),
                linear: turn * Vec3::new(v[0], v[1], v[2]),
            };
        }
    }
    motion
}
