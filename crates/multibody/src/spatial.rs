//! Spatial vectors: angular part first, world axes, taken at a link's origin.

use std::ops::{Add, AddAssign, Sub};

use nalgebra::{Scalar, Vector3};
use orchard_geometry::Vec3;

use crate::lanes::{Packed, Real};
use crate::symmetric::Symmetric3;

/// Motion of a rigid body: a velocity, an acceleration or a velocity change.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Twist<S: Scalar = f64> {
    /// Angular part [rad/s, or rad/s^2].
    pub angular: Vector3<S>,
    /// Linear part of the point at the origin [m/s, or m/s^2].
    pub linear: Vector3<S>,
}

impl Twist {
    /// No motion.
    pub const ZERO: Twist = Twist { angular: Vec3::new(0.0, 0.0, 0.0), linear: Vec3::new(0.0, 0.0, 0.0) };
}

#[expect(private_bounds, reason = "the numbers of the kernels stay inside")]
impl<S: Real> Twist<S> {
    /// Returns the twist of this motion at the point `r` away from the origin.
    #[inline(always)]
    pub fn shifted(&self, r: &Vector3<S>) -> Self {
        Twist { angular: self.angular, linear: self.linear_at(r) }
    }

    /// Linear part at the point `r` away from the origin.
    #[inline(always)]
    pub fn linear_at(&self, r: &Vector3<S>) -> Vector3<S> {
        self.linear + self.angular.cross(r)
    }
}

impl<S: Real> Add for Twist<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Twist { angular: self.angular + other.angular, linear: self.linear + other.linear }
    }
}

impl<S: Real> Packed for Twist<S> {
    type Lane = Twist;

    #[inline(always)]
    fn pack(of: impl Fn(usize) -> Twist) -> Self {
        Twist { angular: Packed::pack(|l| of(l).angular), linear: Packed::pack(|l| of(l).linear) }
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> Twist {
        Twist { angular: self.angular.lane(lane), linear: self.linear.lane(lane) }
    }
}

/// Action on a rigid body: a force or an impulse.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench<S: Scalar = f64> {
    /// Torque about the origin [N m, or N m s].
    pub torque: Vector3<S>,
    /// Force [N, or N s].
    pub force: Vector3<S>,
}

impl Wrench {
    /// No action.
    pub const ZERO: Wrench = Wrench { torque: Vec3::new(0.0, 0.0, 0.0), force: Vec3::new(0.0, 0.0, 0.0) };
}

#[expect(private_bounds, reason = "the numbers of the kernels stay inside")]
impl<S: Real> Wrench<S> {
    /// A pure force at the point `r` away from the origin.
    #[inline(always)]
    pub fn of_force_at(force: Vector3<S>, r: &Vector3<S>) -> Self {
        Wrench { torque: r.cross(&force), force }
    }

    /// Returns this wrench about an origin from which the old one is `r` away.
    #[inline(always)]
    pub fn shifted(&self, r: &Vector3<S>) -> Self {
        Wrench { torque: self.torque + r.cross(&self.force), force: self.force }
    }

    /// Scaled.
    #[inline(always)]
    pub fn scaled(&self, by: S) -> Self {
        Wrench { torque: self.torque * by, force: self.force * by }
    }
}

impl<S: Real> Add for Wrench<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Wrench { torque: self.torque + other.torque, force: self.force + other.force }
    }
}

impl<S: Real> Sub for Wrench<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Wrench { torque: self.torque - other.torque, force: self.force - other.force }
    }
}

impl<S: Real> AddAssign for Wrench<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Real> Packed for Wrench<S> {
    type Lane = Wrench;

    #[inline(always)]
    fn pack(of: impl Fn(usize) -> Wrench) -> Self {
        Wrench { torque: Packed::pack(|l| of(l).torque), force: Packed::pack(|l| of(l).force) }
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> Wrench {
        Wrench { torque: self.torque.lane(lane), force: self.force.lane(lane) }
    }
}

/// Symmetric 6 x 6 inertia that maps a twist to a wrench:
/// `torque = angular * alpha + coupling * a`, `force = coupling^T * alpha + linear * a`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct ArticulatedInertia<S: Scalar = f64> {
    pub angular: Symmetric3<S>,
    /// By columns.
    pub coupling: [Vector3<S>; 3],
    pub linear: Symmetric3<S>,
}

impl ArticulatedInertia {
    pub const ZERO: ArticulatedInertia = ArticulatedInertia {
        angular: Symmetric3::ZERO,
        coupling: [Vec3::new(0.0, 0.0, 0.0); 3],
        linear: Symmetric3::ZERO,
    };
}

impl<S: Real> ArticulatedInertia<S> {
    /// A rigid mass whose centre is `r` from the origin, with inertia `i_com` about its centre:
    /// `i_com - m [r][r]`, `m [r]`, `m 1`.
    #[inline(always)]
    pub fn of_rigid(mass: S, r: &Vector3<S>, i_com: Symmetric3<S>) -> Self {
        let (mr, zero) = (r * mass, S::zero());
        let mut angular = i_com;
        angular.subtract_outer(&mr, r);
        angular.add_diagonal(mr.dot(r));
        let coupling = [
            Vector3::new(zero, mr.z, -mr.y),
            Vector3::new(-mr.z, zero, mr.x),
            Vector3::new(mr.y, -mr.x, zero),
        ];
        ArticulatedInertia { angular, coupling, linear: Symmetric3::diagonal(mass) }
    }

    /// The wrench of a unit rotation about an axis.
    #[inline(always)]
    pub fn of_rotation(&self, axis: &Vector3<S>) -> Wrench<S> {
        let [x, y, z] = &self.coupling;
        Wrench { torque: self.angular * *axis, force: Vector3::new(x.dot(axis), y.dot(axis), z.dot(axis)) }
    }

    /// The wrench of a unit translation along an axis.
    #[inline(always)]
    pub fn of_translation(&self, axis: &Vector3<S>) -> Wrench<S> {
        let [x, y, z] = &self.coupling;
        Wrench { torque: x * axis.x + y * axis.y + z * axis.z, force: self.linear * *axis }
    }

    /// Subtracts `u g^T`, which must be symmetric (or become so in a sum).
    #[inline(always)]
    pub fn subtract_outer(&mut self, u: &Wrench<S>, g: &Wrench<S>) {
        self.angular.subtract_outer(&u.torque, &g.torque);
        for (k, column) in self.coupling.iter_mut().enumerate() {
            *column -= u.torque * g.force[k];
        }
        self.linear.subtract_outer(&u.force, &g.force);
    }

    /// Returns this inertia about an origin from which the old one is `r` away:
    /// `J + [r] H^T - H' [r]`, `H' = H + [r] M`, `M`.
    #[inline(always)]
    pub fn shifted(&self, r: &Vector3<S>) -> Self {
        let [x, y, z] = &self.coupling;
        let [m_x, m_y, m_z] = self.linear.columns();
        let new @ [new_x, new_y, new_z] = [x + r.cross(&m_x), y + r.cross(&m_y), z + r.cross(&m_z)];
        // Column j of [r] H^T is r x (row j of H); row i of H' [r] is (row i of H') x r.
        let cross_x = |y: S, z: S| r.y * z - r.z * y;
        let cross_y = |x: S, z: S| r.z * x - r.x * z;
        let cross_z = |x: S, y: S| r.x * y - r.y * x;
        let change = Symmetric3 {
            xx: cross_x(y.x, z.x) + cross_x(new_y.x, new_z.x),
            xy: cross_x(y.y, z.y) + cross_y(new_x.x, new_z.x),
            xz: cross_x(y.z, z.z) + cross_z(new_x.x, new_y.x),
            yy: cross_y(x.y, z.y) + cross_y(new_x.y, new_z.y),
            yz: cross_y(x.z, z.z) + cross_z(new_x.y, new_y.y),
            zz: cross_z(x.z, y.z) + cross_z(new_x.z, new_y.z),
        };
        ArticulatedInertia { angular: self.angular + change, coupling: new, linear: self.linear }
    }
}

impl<S: Real> Add for ArticulatedInertia<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let ([a, b, c], [d, e, f]) = (self.coupling, other.coupling);
        ArticulatedInertia {
            angular: self.angular + other.angular,
            coupling: [a + d, b + e, c + f],
            linear: self.linear + other.linear,
        }
    }
}

impl<S: Real> AddAssign for ArticulatedInertia<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Real> Packed for ArticulatedInertia<S> {
    type Lane = ArticulatedInertia;

    #[inline(always)]
    fn pack(of: impl Fn(usize) -> ArticulatedInertia) -> Self {
        ArticulatedInertia {
            angular: Packed::pack(|l| of(l).angular),
            coupling: Packed::pack(|l| of(l).coupling),
            linear: Packed::pack(|l| of(l).linear),
        }
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> ArticulatedInertia {
        ArticulatedInertia {
            angular: self.angular.lane(lane),
            coupling: self.coupling.lane(lane),
            linear: self.linear.lane(lane),
        }
    }
}
