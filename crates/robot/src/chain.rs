//! A serial chain of hinges: positions, Jacobian, torques of gravity and motion, reflected inertia.
//!
//! Positions are products of the joint transforms; the Jacobian's columns are (axis; axis x lever), Lynch and
//! Park, Modern Robotics, eq. 5.4 in world axes.

use crate::articulation::{combined, moved, point_inertia};
use crate::joint_values::{JointVector, MAX_ARM_DOF};
use nalgebra::{SMatrix, Unit};
use orchard_geometry::{Mat3, Pose, Rotation, Vec3, inverse_transform, math};
use orchard_multibody::SpatialInertia;

/// Motion of the base, in its own axes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BaseMotion {
    /// Acceleration of the origin of the base frame [m/s2].
    pub acceleration: Vec3,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vec3,
    /// Angular acceleration [rad/s2].
    pub angular_acceleration: Vec3,
}

/// Jacobian of the arm: angular rows first, linear rows second, in the axes of the chain's root frame. The columns beyond the arm's joints
/// are zero.
pub type Jacobian = SMatrix<f64, 6, MAX_ARM_DOF>;

/// One hinge and the link that it carries.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hinge {
    /// Joint frame in the previous link's frame.
    pub x_parent_joint: Pose,
    /// Axis in the joint frame.
    pub axis: Unit<Vec3>,
    /// Inertia of the link in its own frame; the last one carries hand and fingers.
    pub inertia: SpatialInertia,
}

impl Hinge {
    /// Least and largest distance \[m\], over all angles of the hinge, between a point of the previous link and a point of the hinge's own link. Each point is given in the frame of its link.
    fn distances(&self, p_parent: &Vec3, p_link: &Vec3) -> [f64; 2] {
        let axis = self.axis.into_inner();
        let [p_joint, p_turning] = [inverse_transform(&self.x_parent_joint, p_parent), *p_link];
        let along = axis.dot(&(p_joint - p_turning));
        let [a, b] = [p_joint, p_turning].map(|p| (p - axis * axis.dot(&p)).norm());
        [a - b, a + b].map(|across| math::hypot(along, across))
    }

    /// Adds the inertia of a rigid body that is fixed to the link at a pose.
    pub fn carry(&mut self, load: &SpatialInertia, x_link_load: &Pose) {
        self.inertia = combined(&self.inertia, &moved(load, x_link_load));
    }
}

/// The arm's hinges from the base out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chain {
    /// At most [`MAX_ARM_DOF`].
    pub hinges: Vec<Hinge>,
}

/// Poses of the arm's links in the root frame; those beyond the arm's joints are the last link's.
pub(crate) type LinkPoses = [Pose; MAX_ARM_DOF];

impl Chain {
    /// Number of hinges.
    pub fn dof(&self) -> usize {
        self.hinges.len()
    }

    /// Poses of the links in the root frame; those beyond the arm's joints are the last link's.
    pub fn link_poses(&self, q: &JointVector) -> LinkPoses {
        let mut x = Pose::identity();
        std::array::from_fn(|i| {
            let Some(hinge) = self.hinges.get(i) else { return x };
            let turn = Pose::from_parts(Vec3::zeros().into(), Rotation::from_axis_angle(&hinge.axis, q[i]));
            x = x * hinge.x_parent_joint * turn;
            x
        })
    }

    /// Upper bound of the distance between the first joint and the joint before the last \[m\], whatever the posture; joint limits are left out. It is the shortest chain of steps, each along one rigid link or across one hinge.
    pub fn stretch(&self) -> f64 {
        let hinges = &self.hinges;
        let mut longest = vec![0.0; hinges.len()];
        for k in 1..hinges.len() {
            let p_parent = hinges[k].x_parent_joint.translation.vector;
            longest[k] = longest[k - 1] + p_parent.norm();
            if k > 1 {
                longest[k] =
                    longest[k].min(longest[k - 2] + hinges[k - 1].distances(&Vec3::zeros(), &p_parent)[1]);
            }
        }
        longest.iter().rev().nth(1).copied().unwrap_or(0.0)
    }

    /// Least distance between the first joint and the joint before the last \[m\] for a given pose of the last link in the root frame, over all angles of the last joint; 0 for a single joint.
    pub fn apart(&self, x_root_last: &Pose) -> f64 {
        let [first, .., last] = &*self.hinges else { return 0.0 };
        let p_last = inverse_transform(x_root_last, &first.x_parent_joint.translation.vector);
        last.distances(&Vec3::zeros(), &p_last)[0]
    }

    /// Axis of a joint in the root frame; `x` is the pose of its link.
    pub fn axis(&self, i: usize, x: &Pose) -> Vec3 {
        x.rotation * self.hinges[i].axis.into_inner()
    }

    /// Axes of all joints in the root frame; zero beyond the arm's joints.
    pub fn axes(&self, links: &LinkPoses) -> [Vec3; MAX_ARM_DOF] {
        std::array::from_fn(|i| if i < self.dof() { self.axis(i, &links[i]) } else { Vec3::zeros() })
    }

    /// Jacobian of a point `p` (root frame) that moves with the last link.
    pub fn jacobian(&self, links: &LinkPoses, p: &Vec3) -> Jacobian {
        let mut jacobian = Jacobian::zeros();
        for (i, x) in links.iter().enumerate().take(self.dof()) {
            let axis = self.axis(i, x);
            jacobian.fixed_view_mut::<3, 1>(0, i).copy_from(&axis);
            jacobian.fixed_view_mut::<3, 1>(3, i).copy_from(&axis.cross(&(p - x.translation.vector)));
        }
        jacobian
    }

    /// Joint torques [N m] that hold the arm still against gravity (a vector in the root frame, [m/s2]).
    pub fn gravity_torque(&self, q: &JointVector, gravity: &Vec3) -> JointVector {
        let links = self.link_poses(q);
        let mut torque = JointVector::zeros();
        let (mut mass, mut moment) = (0.0, Vec3::zeros());
        for i in (0..self.dof()).rev() {
            let inertia = &self.hinges[i].inertia;
            mass += inertia.mass;
            moment += (links[i] * nalgebra::Point3::from(inertia.p_com)).coords * inertia.mass;
            let lever = moment - links[i].translation.vector * mass;
            torque[i] = -self.axis(i, &links[i]).dot(&lever.cross(gravity));
        }
        torque
    }

    /// Joint torques [N m] that accelerate the arm from rest by `a` [rad/s2]: M(q) a, the sum of `J_v^T m J_v a + J_w^T I J_w a` over the
    /// links (Lynch and Park, Modern Robotics, eq. 8.57).
    pub fn inertial_torque(&self, q: &JointVector, a: &JointVector) -> JointVector {
        let links = self.link_poses(q);
        let mut torque = JointVector::zeros();
        for (i, x) in links.iter().enumerate().take(self.dof()) {
            let inertia = &self.hinges[i].inertia;
            let com = (x * nalgebra::Point3::from(inertia.p_com)).coords;
            let mut jacobian = self.jacobian(&links, &com);
            // Joints beyond a link do not move it.
            jacobian.columns_mut(i + 1, MAX_ARM_DOF - i - 1).fill(0.0);
            let acceleration = jacobian * a;
            let r = x.rotation.to_rotation_matrix().into_inner();
            let angular = r * (inertia.i_com * (r.transpose() * acceleration.fixed_rows::<3>(0)));
            let linear = acceleration.fixed_rows::<3>(3) * inertia.mass;
            torque += jacobian.fixed_rows::<3>(0).transpose() * angular
                + jacobian.fixed_rows::<3>(3).transpose() * linear;
        }
        torque
    }

    /// Joint torques [N m] of a motion on a moving base: inertia, velocity products, gravity and the base's motion. `v` and `a` are the
    /// joint velocities [rad/s] and accelerations [rad/s2]; all vectors are in the root frame.
    ///
    /// The recursive Newton-Euler algorithm (Featherstone, Rigid Body Dynamics Algorithms, sec. 5.3): velocities and accelerations from the
    /// base out, forces back.
    pub fn motion_torque(
        &self,
        q: &JointVector,
        v: &JointVector,
        a: &JointVector,
        base: &BaseMotion,
        gravity: &Vec3,
    ) -> JointVector {
        let links = self.link_poses(q);
        let (mut w, mut alpha) = (base.angular_velocity, base.angular_acceleration);
        let (mut p, mut linear) = (Vec3::zeros(), base.acceleration - gravity);
        // Force and moment about the link's centre of mass, and that centre.
        let mut loads = [(Vec3::zeros(), Vec3::zeros(), Vec3::zeros()); MAX_ARM_DOF];
        for (i, x) in links.iter().enumerate().take(self.dof()) {
            let (axis, inertia) = (self.axis(i, x), &self.hinges[i].inertia);
            let origin = x.translation.vector;
            let r = origin - p;
            linear += alpha.cross(&r) + w.cross(&w.cross(&r));
            alpha += axis * a[i] + w.cross(&(axis * v[i]));
            w += axis * v[i];
            p = origin;
            let com = (x * nalgebra::Point3::from(inertia.p_com)).coords;
            let c = com - origin;
            let turn = x.rotation.to_rotation_matrix().into_inner();
            let about_com = turn * inertia.i_com * turn.transpose();
            let force = (linear + alpha.cross(&c) + w.cross(&w.cross(&c))) * inertia.mass;
            loads[i] = (force, about_com * alpha + w.cross(&(about_com * w)), com);
        }
        let mut torque = JointVector::zeros();
        // Sum of the outer links' forces, and of their moments about the root's origin.
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for i in (0..self.dof()).rev() {
            let (f, n, com) = loads[i];
            force += f;
            moment += n + com.cross(&f);
            torque[i] = self.axis(i, &links[i]).dot(&(moment - links[i].translation.vector.cross(&force)));
        }
        torque
    }

    /// Inertia that each joint moves with all other joints locked [kg m^2]: the diagonal of the mass matrix.
    pub fn reflected_inertia(&self, q: &JointVector) -> JointVector {
        let links = self.link_poses(q);
        let mut reflected = JointVector::zeros();
        // Second moment about the root's origin, first moment and mass of all links further out.
        let (mut mass, mut moment, mut second) = (0.0, Vec3::zeros(), Mat3::zeros());
        for i in (0..self.dof()).rev() {
            let inertia = &self.hinges[i].inertia;
            let r = links[i].rotation.to_rotation_matrix().into_inner();
            let com = (links[i] * nalgebra::Point3::from(inertia.p_com)).coords;
            mass += inertia.mass;
            moment += com * inertia.mass;
            second += r * inertia.i_com * r.transpose() + point_inertia(inertia.mass, &com);
            let p = links[i].translation.vector;
            // Steiner: about p, with c = moment / mass the centre of mass of the outer part.
            let cross = p * moment.transpose();
            let shift = Mat3::identity() * (2.0 * p.dot(&moment)) - cross - cross.transpose();
            let about_p = second - shift + point_inertia(mass, &p);
            let axis = self.axis(i, &links[i]);
            reflected[i] = axis.dot(&(about_p * axis));
        }
        reflected
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RobotModel;

    /// Over a turn of the hinge, the distance between a point before it and one behind it lies between the two that are told, and comes to both.
    #[test]
    fn a_hinge_tells_the_least_and_the_largest_distance() {
        let hinge = Hinge {
            x_parent_joint: Pose::from_parts(
                Vec3::new(0.1, -0.2, 0.3).into(),
                Rotation::from_axis_angle(&Vec3::x_axis(), 0.7),
            ),
            axis: Unit::new_normalize(Vec3::new(0.2, 0.5, 1.0)),
            inertia: SpatialInertia { mass: 1.0, p_com: Vec3::zeros(), i_com: Mat3::identity() },
        };
        let (p_parent, p_link) = (Vec3::new(0.4, 0.1, -0.2), Vec3::new(-0.1, 0.3, 0.2));
        let (mut least, mut largest) = (f64::INFINITY, 0.0_f64);
        for degree in 0..3600 {
            let turn = Rotation::from_axis_angle(&hinge.axis, f64::from(degree) * 0.1_f64.to_radians());
            let x_parent_link = hinge.x_parent_joint * Pose::from_parts(Vec3::zeros().into(), turn);
            let distance =
                (x_parent_link * nalgebra::Point3::from(p_link) - nalgebra::Point3::from(p_parent)).norm();
            (least, largest) = (least.min(distance), largest.max(distance));
        }
        let told = hinge.distances(&p_parent, &p_link);
        assert!(
            (told[0] - least).abs() < 1e-6 && (told[1] - largest).abs() < 1e-6,
            "{told:?} {least} {largest}"
        );
    }

    /// The stretch of the paper's arm from shoulder to wrist is that of upper arm and forearm, each with its elbow's offset of 82.5 mm.
    #[test]
    fn an_arm_stretches_by_its_offsets() {
        let robot = RobotModel::paper();
        let stretch = robot.kinematics().chain.stretch();
        let bone = |length: f64| math::hypot(length, 0.0825);
        assert!((stretch - bone(0.316) - bone(0.384)).abs() < 1e-9, "{stretch} m");
    }
}
