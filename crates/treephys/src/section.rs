//! Beam theory of a solid circular section, and the inertia of a capsule.

use orchard_geometry::{Mat3, Vec3};
use orchard_multibody::SpatialInertia;
use std::f64::consts::{FRAC_PI_4, PI};

/// Second moment of area I = pi r^4 / 4 [m^4].
pub fn second_moment(radius: f64) -> f64 {
    FRAC_PI_4 * radius * radius * radius * radius
}

/// Section modulus Z = pi r^3 / 4 [m^3].
pub fn section_modulus(radius: f64) -> f64 {
    FRAC_PI_4 * radius * radius * radius
}

/// Bending stiffness of a joint, Kp = E I / l [N m/rad] (Jacob et al. 2024, after Euler-Bernoulli).
pub fn joint_stiffness(youngs_modulus: f64, radius: f64, length: f64) -> f64 {
    youngs_modulus * second_moment(radius) / length
}

/// Largest bending moment that a section carries, sigma_r Z [N m].
pub fn rupture_moment(rupture_stress: f64, radius: f64) -> f64 {
    rupture_stress * section_modulus(radius)
}

/// A homogeneous capsule whose axis runs from the origin to (0, 0, length).
pub fn capsule_inertia(density: f64, radius: f64, length: f64) -> SpatialInertia {
    let (r2, l2) = (radius * radius, length * length);
    let cylinder = density * PI * r2 * length;
    let hemisphere = density * 2.0 / 3.0 * PI * r2 * radius;
    let axial = cylinder * r2 / 2.0 + 2.0 * hemisphere * 0.4 * r2;
    // Hemisphere about the capsule's centre: 2/5 r^2 about the ball's centre, moved by l/2 and 3r/8.
    let transverse = cylinder * (l2 / 12.0 + r2 / 4.0)
        + 2.0 * hemisphere * (0.4 * r2 + l2 / 4.0 + 3.0 / 8.0 * length * radius);
    SpatialInertia {
        mass: cylinder + 2.0 * hemisphere,
        p_com: Vec3::new(0.0, 0.0, 0.5 * length),
        i_com: Mat3::from_diagonal(&Vec3::new(transverse, transverse, axial)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reference_case() {
        // docs/references.bib: orchard_reference, dyn.EB_case (r = 10 mm, E = 7 GPa, 50 MPa).
        assert!((7e9 * second_moment(0.01) - 54.978).abs() < 1e-3);
        assert!((rupture_moment(50e6, 0.01) - 39.27).abs() < 1e-2);
    }

    #[test]
    fn capsule_limits() {
        // Length 0: a ball, 2/5 m r^2. Radius -> 0: a rod, m l^2 / 12.
        let ball = capsule_inertia(1000.0, 0.1, 0.0);
        assert!((ball.mass - 1000.0 * 4.0 / 3.0 * PI * 1e-3).abs() < 1e-12);
        assert!((ball.i_com[(0, 0)] - 0.4 * ball.mass * 0.01).abs() < 1e-12);
        assert!((ball.i_com[(2, 2)] - ball.i_com[(0, 0)]).abs() < 1e-15);
        let rod = capsule_inertia(1000.0, 1e-6, 1.0);
        assert!((rod.i_com[(0, 0)] / (rod.mass / 12.0) - 1.0).abs() < 1e-5);
    }
}
