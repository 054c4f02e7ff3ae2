//! A rod that bends and twists: the spring of a ball joint.

use nalgebra::{Quaternion, UnitQuaternion};
use orchard_geometry::{Vec3, math};

/// Bend and twist of the rod of a ball joint. The rod runs along z; its rotation is a twist about z, then a bend about an
/// axis square to z (the swing-twist decomposition of a quaternion; Dobrowolski 2015, arXiv:1506.05481).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deflection {
    /// Bending angle about its axis \[rad\], in the link's axes; z is 0.
    pub bend: Vec3,
    /// Twist about z \[rad\], between -2 pi and 2 pi.
    pub twist: f64,
    /// Change of the twist by a turn of the link, in the link's axes: `d twist = twist_gradient . omega dt`.
    twist_gradient: Vec3,
}

impl Deflection {
    /// Takes a rotation (x, y, z, w) apart.
    pub(crate) fn of(q: &[f64]) -> Self {
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(q[3], q[0], q[1], q[2]));
        // The rod's direction at rest, in the link's axes; its direction now is z.
        let rest = rotation.inverse() * Vec3::z();
        let normal = rest.cross(&Vec3::z());
        let sine = normal.norm();
        let bend = if sine > 0.0 { normal * (math::atan2(sine, rest.z) / sine) } else { Vec3::zeros() };
        // A turn about the mean of both directions is all twist, one square to it none. Doubled over, a rod has no twist.
        let both = 1.0 + rest.z;
        let twist_gradient = if both > DOUBLED_OVER { (rest + Vec3::z()) / both } else { Vec3::zeros() };
        Self { bend, twist: 2.0 * math::atan2(q[2], q[3]), twist_gradient }
    }

    /// Torque of the rod's spring on the link, in the link's axes [N m]: minus the gradient of its energy.
    pub(crate) fn torque(&self, bending: f64, twisting: f64) -> Vec3 {
        -(self.bend * bending + self.twist_gradient * (twisting * self.twist))
    }

    /// Energy of the rod's spring \[J\].
    pub(crate) fn energy(&self, bending: f64, twisting: f64) -> f64 {
        0.5 * (bending * self.bend.norm_squared() + twisting * self.twist * self.twist)
    }
}

/// `1 + cos(bend)` below which the twist has no direction; round-off apart, a bend of half a turn.
const DOUBLED_OVER: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    fn rotation(axis: Vec3, angle: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(axis.normalize() * angle)
    }

    #[test]
    fn a_bent_and_twisted_rod_is_taken_apart() {
        let (bend, twist) = (rotation(Vec3::new(0.6, -0.8, 0.0), 1.2), rotation(Vec3::z(), 2.5));
        let deflection = Deflection::of((bend * twist).coords.as_slice());
        assert!((deflection.twist - 2.5).abs() < 1e-14);
        assert!((twist * deflection.bend - Vec3::new(0.72, -0.96, 0.0)).norm() < 1e-14);
    }

    #[test]
    fn torque_is_the_slope_of_the_energy() {
        let q = rotation(Vec3::new(0.3, 1.0, -0.7), 1.9);
        let deflection = Deflection::of(q.coords.as_slice());
        let torque = deflection.torque(0.3, 0.7);
        for axis in 0..3 {
            let step = 1e-6;
            let energy = |sign: f64| {
                let turned = q * rotation(Vec3::ith(axis, 1.0), sign * step);
                Deflection::of(turned.coords.as_slice()).energy(0.3, 0.7)
            };
            let slope = (energy(1.0) - energy(-1.0)) / (2.0 * step);
            assert!((torque[axis] + slope).abs() < 1e-8, "{axis}: {} {slope}", torque[axis]);
        }
    }

    #[test]
    fn a_rod_that_is_doubled_over_pulls_back_without_a_jump() {
        let deflection = Deflection::of(rotation(Vec3::x(), std::f64::consts::PI).coords.as_slice());
        assert!(deflection.torque(0.3, 0.7).iter().all(|x| x.is_finite()));
        assert_eq!(Deflection::of(&[0.0, 0.0, 0.0, 1.0]).torque(1.0, 1.0), Vec3::zeros());
    }
}
