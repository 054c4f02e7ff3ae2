//! Spatial vectors: angular part first, world axes, taken at a link's origin.

use std::ops::{Add, AddAssign, Sub};

use orchard_geometry::{Mat3, Vec3};

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
    pub angular: Mat3,
    pub coupling: Mat3,
    pub linear: Mat3,
}

impl ArticulatedInertia {
    pub const ZERO: ArticulatedInertia = ArticulatedInertia {
        angular: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        coupling: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        linear: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// Adds a rigid mass whose centre is `r` from the origin, with inertia `i_com` about its centre.
    pub fn add_rigid(&mut self, mass: f64, r: &Vec3, i_com: &Mat3) {
        self.angular += i_com;
        self.add_point_mass(mass, r);
    }

    /// Adds a point mass `r` from the origin: `-m [r][r]`, `m [r]`, `m 1`.
    pub fn add_point_mass(&mut self, mass: f64, r: &Vec3) {
        let mr = r * mass;
        let square = mr.dot(r);
        self.angular -= mr * r.transpose();
        for k in 0..3 {
            self.angular[(k, k)] += square;
            self.linear[(k, k)] += mass;
        }
        self.coupling += mr.cross_matrix();
    }

    /// Adds the inertia of a child whose origin is `r` from this one:
    /// `M`, `H + [r] M`, `J + [r] H^T - (H + [r] M) [r]`.
    pub fn add_shifted(&mut self, child: &ArticulatedInertia, r: &Vec3) {
        let coupling = child.coupling + cross_columns(r, &child.linear);
        self.angular += child.angular
            + cross_columns(r, &child.coupling.transpose())
            + cross_columns(r, &coupling.transpose()).transpose();
        self.coupling += coupling;
        self.linear += child.linear;
    }
}

/// `[r] A`: the cross product of `r` with every column.
fn cross_columns(r: &Vec3, a: &Mat3) -> Mat3 {
    Mat3::from_columns(&[
        r.cross(&a.column(0).into_owned()),
        r.cross(&a.column(1).into_owned()),
        r.cross(&a.column(2).into_owned()),
    ])
}
