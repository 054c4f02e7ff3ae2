//! Inertias of links: sums, and the nearest one of a body where a description has that of none.

use super::place::pose_of;
use crate::RobotError;
use crate::warning::Warning;
use nalgebra::SymmetricEigen;
use orchard_geometry::{Mat3, Pose, Vec3, transform};
use orchard_multibody::SpatialInertia;

/// Share by which principal moments may break the triangle inequality: the rounding of six printed digits.
pub(crate) const ROUNDING: f64 = 1e-5;

/// Least radius of gyration along a principal axis \[m\] of an inertia that replaces an impossible one, our own choice.
const LEAST_SPREAD: f64 = 1e-3;

/// Radius of gyration \[m\] below which an inertia is that of no body, our own choice.
const NO_SPREAD: f64 = 1e-5;

/// Mass \[kg\] below which a link that moves has none, our own choice.
pub(super) const NO_MASS: f64 = 1e-9;

/// Mass that a link gets that moves and has none \[kg\], our own choice: that of a screw.
const LEAST_MASS: f64 = 1e-3;

/// Radius of the ball that such a link is taken for \[m\], our own choice.
const LEAST_RADIUS: f64 = 0.02;

/// No mass and no inertia.
pub(crate) fn massless() -> SpatialInertia {
    SpatialInertia { mass: 0.0, p_com: Vec3::zeros(), i_com: Mat3::zeros() }
}

/// Inertia of a link that moves and has none: a small ball at its joint.
pub(super) fn least() -> SpatialInertia {
    let moment = 0.4 * LEAST_MASS * LEAST_RADIUS * LEAST_RADIUS;
    SpatialInertia { mass: LEAST_MASS, p_com: Vec3::zeros(), i_com: Mat3::identity() * moment }
}

/// Inertia matrix of a URDF link in the axes of its inertial frame.
pub(crate) fn matrix_of(link: &urdf_rs::Link) -> Mat3 {
    let i = &link.inertial.inertia;
    Mat3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz)
}

/// Inertia of a URDF link in the frame of the moving link that carries it at `x`.
pub(super) fn inertia_of(
    link: &urdf_rs::Link,
    x: &Pose,
    warnings: &mut Vec<Warning>,
) -> Result<SpatialInertia, RobotError> {
    let place = format!("inertia of link `{}`", link.name);
    let (mass, matrix) = (link.inertial.mass.value, matrix_of(link));
    let x_inertial = x * pose_of(&place, &link.inertial.origin)?;
    if mass == 0.0 {
        if matrix != Mat3::zeros() {
            warnings.push(Warning::InertiaWithoutMass { link: link.name.clone() });
        }
        return Ok(massless());
    }
    let i_com = match is_possible(mass, &matrix) {
        true => matrix,
        false => {
            let nearest = nearest_possible(mass, &matrix);
            warnings.push(Warning::ImpossibleInertia {
                link: link.name.clone(),
                moments: moments(&matrix),
                replaced_by: moments(&nearest),
            });
            nearest
        }
    };
    Ok(moved(&SpatialInertia { mass, p_com: Vec3::zeros(), i_com }, &x_inertial))
}

/// Principal moments, the smallest first.
pub(crate) fn moments(inertia: &Mat3) -> [f64; 3] {
    let mut moments: [f64; 3] = inertia.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    moments
}

/// True if all principal moments are positive and none is larger than the sum of the others.
fn is_possible(mass: f64, inertia: &Mat3) -> bool {
    let [a, b, c] = moments(inertia);
    a > mass * NO_SPREAD * NO_SPREAD && c <= (a + b) * (1.0 + ROUNDING)
}

/// Nearest inertia of a body with the same mass.
///
/// An inertia I is that of a body if J = tr(I) / 2 - I, the matrix of second moments of its mass, has no negative eigenvalue. Eigenvalues
/// of J below `mass * LEAST_SPREAD^2` are raised to that, which gives the nearest such matrix in the Frobenius norm.
fn nearest_possible(mass: f64, inertia: &Mat3) -> Mat3 {
    let second = Mat3::identity() * (0.5 * inertia.trace()) - inertia;
    let SymmetricEigen { eigenvectors, eigenvalues } = second.symmetric_eigen();
    let least = mass * LEAST_SPREAD * LEAST_SPREAD;
    let raised = eigenvalues.map(|x| x.max(least));
    let second = eigenvectors * Mat3::from_diagonal(&raised) * eigenvectors.transpose();
    let nearest = Mat3::identity() * second.trace() - second;
    (nearest + nearest.transpose()) * 0.5
}

/// Transforms an inertia from frame b to frame a.
pub(crate) fn moved(inertia: &SpatialInertia, x_a_b: &Pose) -> SpatialInertia {
    let r = x_a_b.rotation.to_rotation_matrix().into_inner();
    SpatialInertia {
        mass: inertia.mass,
        p_com: transform(x_a_b, &inertia.p_com),
        i_com: r * inertia.i_com * r.transpose(),
    }
}

/// Inertia of a point mass at `p` about the origin [kg m^2] (parallel-axis theorem).
pub(crate) fn point_inertia(mass: f64, p: &Vec3) -> Mat3 {
    (Mat3::identity() * p.norm_squared() - p * p.transpose()) * mass
}

/// Inertia of two bodies welded together; all inertias in one frame.
pub(crate) fn combined(a: &SpatialInertia, b: &SpatialInertia) -> SpatialInertia {
    let mass = a.mass + b.mass;
    if mass == 0.0 {
        return massless();
    }
    let p_com = (a.p_com * a.mass + b.p_com * b.mass) / mass;
    let i_com = a.i_com
        + b.i_com
        + point_inertia(a.mass, &(a.p_com - p_com))
        + point_inertia(b.mass, &(b.p_com - p_com));
    SpatialInertia { mass, p_com, i_com }
}
