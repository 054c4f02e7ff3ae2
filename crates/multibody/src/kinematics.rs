//! Forward kinematics: poses, joint axes, velocities and bias accelerations, root to tips.

use nalgebra::{Quaternion, Vector3};
use orchard_geometry::{Pose, Rotation, Vec3, math};

use crate::lanes::{Packed, Pair, Real, each, pack_rows};
use crate::model::{BodyId, JointKind, Model};
use crate::rotation::{Turn, combine};
use crate::schedule::Slot;
use crate::spatial::Twist;
use crate::symmetric::Symmetric3;

/// Kinematics of one link in a state. World axes, at the link's origin.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    /// Pose of the link.
    pub x_world_body: Pose,
    /// Axes of the link: the columns of its rotation matrix.
    pub turn: [Vec3; 3],
    /// From the parent's origin (the world's for a root) to this origin \[m\].
    pub r_parent: Vec3,
    /// From the origin to the centre of mass \[m\].
    pub r_com: Vec3,
    /// Inertia about the centre of mass [kg m^2].
    pub i_com: Symmetric3,
    /// Velocity.
    pub velocity: Twist,
    /// Acceleration of the link at its origin with all joint accelerations zero [rad/s^2, m/s^2].
    pub bias_acceleration: Twist,
}

impl Link {
    /// The world as a link that never moves.
    fn world() -> Link {
        Link {
            x_world_body: Pose::identity(),
            turn: [Vec3::x(), Vec3::y(), Vec3::z()],
            r_parent: Vec3::zeros(),
            r_com: Vec3::zeros(),
            i_com: Symmetric3::ZERO,
            velocity: Twist::ZERO,
            bias_acceleration: Twist::ZERO,
        }
    }

    pub fn origin(&self) -> &Vec3 {
        &self.x_world_body.translation.vector
    }

    /// A vector of the link's frame in world axes.
    #[inline]
    pub fn turned(&self, vector: &Vec3) -> Vec3 {
        combine(&self.turn, vector)
    }
}

/// Kinematics of all links, and the state that they belong to.
#[derive(Debug, Clone)]
pub(crate) struct Kinematics {
    pub links: Vec<Link>,
    /// Axis of each degree of freedom, world.
    pub axes: Vec<Vec3>,
    /// Parent of the roots.
    world: Link,
    q: Vec<f64>,
    v: Vec<f64>,
}

impl Kinematics {
    pub fn new(model: &Model) -> Kinematics {
        Kinematics {
            links: vec![Link::world(); model.bodies.len()],
            axes: vec![Vec3::zeros(); model.nv()],
            world: Link::world(),
            q: vec![f64::NAN; model.nq()],
            v: vec![f64::NAN; model.nv()],
        }
    }

    /// Brings poses, axes, velocities and bias accelerations up to a state. Does nothing if they are already.
    pub fn update(&mut self, model: &Model, q: &[f64], v: &[f64]) {
        if are_same(&self.q, q) && are_same(&self.v, v) {
            return;
        }
        self.q.copy_from_slice(q);
        self.v.copy_from_slice(v);
        for slot in &model.schedule {
            match slot {
                Slot::One([index]) => self.update_one(model, q, v, *index),
                Slot::Two(links) => {
                    let frame = joint_frame::<Pair>(model, self, links);
                    let q = pack_rows(each(links, |link| &q[model.q_start[link]..]));
                    let v = pack_rows(each(links, |link| &v[model.v_start[link]..]));
                    let (motion, axes) = universal_motion(&frame, q, v);
                    for (l, link) in links.iter().enumerate() {
                        self.axes[model.dof_range(*link)]
                            .copy_from_slice(&[axes[0].lane(l), axes[1].lane(l)]);
                    }
                    place(model, self, links, &motion);
                }
            }
        }
    }

    /// As [`Self::update`], where no coordinates have changed but those of some bodies, listed with all that they bear, parents first.
    pub fn update_only(&mut self, model: &Model, q: &[f64], v: &[f64], bodies: &[BodyId]) {
        for &id in bodies {
            let (qs, dofs) = (model.qs(id), model.dofs(id));
            self.q[qs.clone()].copy_from_slice(&q[qs]);
            self.v[dofs.clone()].copy_from_slice(&v[dofs]);
            self.update_one(model, q, v, id.index());
        }
    }

    fn update_one(&mut self, model: &Model, q: &[f64], v: &[f64], index: usize) {
        let frame = joint_frame::<f64>(model, self, &[index]);
        let (q_start, v_start) = (model.q_start[index], model.v_start[index]);
        let (q, v) = (&q[q_start..], &v[v_start..]);
        let motion = joint_motion(&model.bodies[index].joint, &frame, q, v, &mut self.axes[v_start..]);
        place(model, self, &[index], &motion);
    }

    fn parent<'a>(&'a self, model: &Model, index: usize) -> &'a Link {
        model.bodies[index].parent.map_or(&self.world, |parent| &self.links[parent.index()])
    }
}

/// Motion of a link relative to its parent.
struct JointMotion<S: Real> {
    /// Rotation of the link in the world.
    rotation: Turn<S>,
    /// From the joint frame's origin to the link's origin, world axes.
    translation: Vector3<S>,
    /// Velocity relative to the parent at the link's origin, world axes.
    velocity: Twist<S>,
    /// Part of the angular bias acceleration that the joint makes by itself: the second axis of a universal
    /// joint turns with the first.
    bias_angular: Vector3<S>,
}

/// True if two states have the same bits. The loop has no early exit, so that it vectorises.
fn are_same(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).fold(0, |differing, (a, b)| differing | (a.to_bits() ^ b.to_bits())) == 0
}

/// Rotation of the joint frame of links in the world.
#[inline(always)]
fn joint_frame<S: Real>(model: &Model, kinematics: &Kinematics, links: &[usize]) -> Turn<S> {
    let parents = each(links, |link| kinematics.parent(model, link));
    let bodies = each(links, |link| &model.bodies[link]);
    let rotation = Turn::<S>::pack(|l| parents[l].x_world_body.rotation);
    rotation.after(&Turn::pack(|l| bodies[l].x_parent_joint.rotation))
}

/// Places links on their parents.
#[inline(always)]
fn place<S: Real>(model: &Model, kinematics: &mut Kinematics, links: &[usize], motion: &JointMotion<S>) {
    let parents = each(links, |link| kinematics.parent(model, link));
    let bodies = each(links, |link| &model.bodies[link]);
    let joint_arm = combine(
        &<[Vector3<S>; 3]>::pack(|l| parents[l].turn),
        &Vector3::pack(|l| bodies[l].x_parent_joint.translation.vector),
    );
    let r_parent = joint_arm + motion.translation;
    let origin = Vector3::pack(|l| *parents[l].origin()) + r_parent;
    let turn = motion.rotation.columns();

    // The bias acceleration is d/dt of the velocity recursion with constant joint velocities; the joint's axes
    // turn with the parent, which gives the cross products with the parent's angular velocity.
    let velocity = Twist::<S>::pack(|l| parents[l].velocity);
    let bias = Twist::<S>::pack(|l| parents[l].bias_acceleration);
    let (omega, slip) = (&velocity.angular, &motion.velocity.linear);
    let carried = omega.cross(&r_parent);
    let bias_acceleration = Twist {
        angular: bias.angular + omega.cross(&motion.velocity.angular) + motion.bias_angular,
        linear: bias.linear_at(&r_parent) + omega.cross(&(carried + slip + slip)),
    };
    let velocity =
        Twist { angular: omega + motion.velocity.angular, linear: velocity.linear + carried + slip };
    let r_com = combine(&turn, &Vector3::pack(|l| bodies[l].inertia.p_com));
    let i_com = Symmetric3::pack(|l| Symmetric3::of_upper(&bodies[l].inertia.i_com)).rotated(&turn);
    for (l, link) in links.iter().enumerate() {
        let link = &mut kinematics.links[*link];
        link.x_world_body.rotation = motion.rotation.lane(l);
        link.x_world_body.translation.vector = origin.lane(l);
        link.turn = turn.lane(l);
        link.r_parent = r_parent.lane(l);
        link.r_com = r_com.lane(l);
        link.i_com = i_com.lane(l);
        link.velocity = velocity.lane(l);
        link.bias_acceleration = bias_acceleration.lane(l);
    }
}

/// Rotation about a unit axis.
fn rotation_about(axis: &Vec3, angle: f64) -> Turn<f64> {
    let (s, c) = math::sin_cos(0.5 * angle);
    Turn { vector: axis * s, scalar: c }
}

/// Rotation by the vector `angle * axis`.
pub(crate) fn rotation_by(vector: &Vec3) -> Rotation {
    let angle = vector.norm();
    if angle == 0.0 { Rotation::identity() } else { rotation_about(&(vector / angle), angle).lane(0) }
}

/// Motion and axes of universal joints whose frames have the rotation `frame` in the world.
#[inline(always)]
fn universal_motion<S: Real>(frame: &Turn<S>, q: [S; 2], v: [S; 2]) -> (JointMotion<S>, [Vector3<S>; 2]) {
    let half = S::splat(0.5);
    let ((s_x, c_x), (s_y, c_y)) = ((half * q[0]).sin_cos(), (half * q[1]).sin_cos());
    // The product of the two rotations about x and y. The second turns about its own y, which is the link's.
    let turn = Turn { vector: Vector3::new(s_x * c_y, c_x * s_y, s_x * s_y), scalar: c_x * c_y };
    let rotation = frame.after(&turn);
    let axes = [frame.columns()[0], rotation.columns()[1]];
    let motion = JointMotion {
        rotation,
        translation: Vector3::zeros(),
        velocity: Twist { angular: axes[0] * v[0] + axes[1] * v[1], linear: Vector3::zeros() },
        bias_angular: axes[0].cross(&axes[1]) * (v[0] * v[1]),
    };
    (motion, axes)
}

/// The rotation of a joint's quaternion (x, y, z, w).
fn turn_of(q: &[f64]) -> Turn<f64> {
    let quaternion = Quaternion::new(q[3], q[0], q[1], q[2]);
    Turn::pack(|_| Rotation::from_quaternion(quaternion))
}

/// Motion of a joint whose frame has the rotation `frame` in the world; fills the joint's axes.
fn joint_motion(
    joint: &JointKind,
    frame: &Turn<f64>,
    q: &[f64],
    v: &[f64],
    axes: &mut [Vec3],
) -> JointMotion<f64> {
    let mut motion = JointMotion {
        rotation: *frame,
        translation: Vec3::zeros(),
        velocity: Twist::ZERO,
        bias_angular: Vec3::zeros(),
    };
    match joint {
        JointKind::Weld => {}
        JointKind::Hinge(axis) => {
            axes[0] = combine(&frame.columns(), axis);
            motion.rotation = frame.after(&rotation_about(axis, q[0]));
            motion.velocity.angular = axes[0] * v[0];
        }
        JointKind::Slide(axis) => {
            axes[0] = combine(&frame.columns(), axis);
            motion.translation = axes[0] * q[0];
            motion.velocity.linear = axes[0] * v[0];
        }
        JointKind::Universal => {
            let both;
            (motion, both) = universal_motion(frame, [q[0], q[1]], [v[0], v[1]]);
            axes[..2].copy_from_slice(&both);
        }
        JointKind::Ball => {
            motion.rotation = frame.after(&turn_of(q));
            let columns = motion.rotation.columns();
            axes[..3].copy_from_slice(&columns);
            motion.velocity.angular = combine(&columns, &Vec3::from_column_slice(&v[..3]));
        }
        JointKind::Planar => {
            axes[..3].copy_from_slice(&frame.columns());
            motion.rotation = frame.after(&rotation_about(&Vec3::z(), q[2]));
            motion.translation = axes[0] * q[0] + axes[1] * q[1];
            motion.velocity = Twist { angular: axes[2] * v[2], linear: axes[0] * v[0] + axes[1] * v[1] };
        }
        JointKind::Free => {
            let columns = frame.columns();
            axes[..3].copy_from_slice(&columns);
            axes[3..6].copy_from_slice(&columns);
            let along = |c: &[f64]| combine(&columns, &Vec3::from_column_slice(&c[..3]));
            motion.rotation = frame.after(&turn_of(&q[3..]));
            motion.translation = along(q);
            motion.velocity = Twist { angular: along(&v[3..]), linear: along(v) };
        }
    }
    motion
}
