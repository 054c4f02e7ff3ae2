//! Spatial vectors: angular part first, world axes, taken at a link's origin.

use std::ops::{Add, AddAssign, Sub};

use orchard_geometry::{Mat3, Vec3};

use crate::symmetric::Symmetric3;

/// Motion of a rigid body: a velocity, an acceleration or a velocity change.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Twist {
    /// Angular part [rad/s, or rad/s^2].
    pub angular: Vec3,
    /// Linear part of the point at the origin [m/s, or m/s^2].
    pub linear: Vec3,
}

impl Twist {
    /// No motion.
    pub const ZERO: Twist = Twist { angular: Vec3::new(0.0, 0.0, 0.0), linear: Vec3::new(0.0, 0.0, 0.0) };

    /// The same motion seen at the point `r` away from the origin.
    pub fn shifted(&self, r: &Vec3) -> Twist {
        Twist { angular: self.angular, linear: self.linear_at(r) }
    }

    /// Linear part at the point `r` away from the origin.
    pub fn linear_at(&self, r: &Vec3) -> Vec3 {
        self.linear + self.angular.cross(r)
    }
}

impl Add for Twist {
    type Output = Twist;
    fn add(self, other: Twist) -> Twist {
        Twist { angular: self.angular + other.angular, linear: self.linear + other.linear }
    }
}

/// Action on a rigid body: a force or an impulse.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// Torque about the origin [N m, or N m s].
    pub torque: Vec3,
    /// Force [N, or N s].
    pub force: Vec3,
}

impl Wrench {
    /// No action.
    pub const ZERO: Wrench = Wrench { torque: Vec3::new(0.0, 0.0, 0.0), force: Vec3::new(0.0, 0.0, 0.0) };

    /// A pure force at the point `r` away from the origin.
    pub fn of_force_at(force: Vec3, r: &Vec3) -> Wrench {
        Wrench { torque: r.cross(&force), force }
    }

    /// The same action about an origin from which the old one is `r` away.
    pub fn shifted(&self, r: &Vec3) -> Wrench {
        Wrench { torque: self.torque + r.cross(&self.force), force: self.force }
    }

    /// Scaled.
    pub fn scaled(&self, by: f64) -> Wrench {
        Wrench { torque: self.torque * by, force: self.force * by }
    }
}

impl Add for Wrench {
    type Output = Wrench;
    fn add(self, other: Wrench) -> Wrench {
        Wrench { torque: self.torque + other.torque, force: self.force + other.force }
    }
}

impl Sub for Wrench {
    type Output = Wrench;
    fn sub(self, other: Wrench) -> Wrench {
        Wrench { torque: self.torque - other.torque, force: self.force - other.force }
    }
}

impl AddAssign for Wrench {
    fn add_assign(&mut self, other: Wrench) {
        *self = *self + other;
    }
}

/// Symmetric 6 x 6 inertia that maps a twist to a wrench:
/// `torque = angular * alpha + coupling * a`, `force = coupling^T * alpha + linear * a`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ArticulatedInertia {
    pub angular: Symmetric3,
    pub coupling: Mat3,
    pub linear: Symmetric3,
}

impl ArticulatedInertia {
    pub const ZERO: ArticulatedInertia = ArticulatedInertia {
        angular: Symmetric3::ZERO,
        coupling: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        linear: Symmetric3::ZERO,
    };

    /// A rigid mass whose centre is `r` from the origin, with inertia `i_com` about its centre.
    pub fn of_rigid(mass: f64, r: &Vec3, i_com: Symmetric3) -> ArticulatedInertia {
        let mut inertia = ArticulatedInertia { angular: i_com, ..ArticulatedInertia::ZERO };
        inertia.add_point_mass(mass, r);
        inertia
    }

    /// Adds a point mass `r` from the origin: `-m [r][r]`, `m [r]`, `m 1`.
    pub fn add_point_mass(&mut self, mass: f64, r: &Vec3) {
        let mr = r * mass;
        self.angular.subtract_outer(&mr, r);
        self.angular.add_diagonal(mr.dot(r));
        self.linear.add_diagonal(mass);
        self.coupling += mr.cross_matrix();
    }

    /// Adds the inertia of a child whose origin is `r` from this one:
    /// `M`, `H' = H + [r] M`, `J + [r] H^T - H' [r]`.
    #[inline]
    pub fn add_shifted(&mut self, child: &ArticulatedInertia, r: &Vec3) {
        let old = &child.coupling;
        let [m_x, m_y, m_z] = child.linear.columns();
        let mut new = *old;
        new += Mat3::from_columns(&[r.cross(&m_x), r.cross(&m_y), r.cross(&m_z)]);
        // Column j of [r] H^T is r x (row j of H); row i of H' [r] is (row i of H') x r.
        let row = |m: &Mat3, k: usize| Vec3::new(m[(k, 0)], m[(k, 1)], m[(k, 2)]);
        let h = [row(old, 0), row(old, 1), row(old, 2)];
        let n = [row(&new, 0), row(&new, 1), row(&new, 2)];
        let cross_x = |v: &Vec3| r.y * v.z - r.z * v.y;
        let cross_y = |v: &Vec3| r.z * v.x - r.x * v.z;
        let cross_z = |v: &Vec3| r.x * v.y - r.y * v.x;
        self.angular += child.angular;
        self.angular += Symmetric3 {
            xx: cross_x(&h[0]) + cross_x(&n[0]),
            xy: cross_x(&h[1]) + cross_y(&n[0]),
            xz: cross_x(&h[2]) + cross_z(&n[0]),
            yy: cross_y(&h[1]) + cross_y(&n[1]),
            yz: cross_y(&h[2]) + cross_z(&n[1]),
            zz: cross_z(&h[2]) + cross_z(&n[2]),
        };
        self.coupling += new;
        self.linear += child.linear;
    }
}
