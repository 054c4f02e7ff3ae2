//! Plausibility bounds on the numbers of a robot description.
//!
//! A file may hold any double-precision number, and collision queries fail on sizes of 1e12 m. These bounds are far beyond any robot and keep
//! products of a few such numbers far from overflow and cancellation.

use crate::RobotError;

/// Largest size and offset, and farthest joint from the root at q = 0 \[m\]: positions keep a resolution of 1e-13 m.
pub(crate) const LENGTH_MAX: f64 = 1e3;

/// Largest mass of a link \[kg\].
pub(crate) const MASS_MAX: f64 = 1e6;

/// Largest moment of inertia of a link [kg m^2]: the largest mass at 30 m.
pub(crate) const INERTIA_MAX: f64 = 1e9;

/// Largest angle, position limit and axis component [rad, m or 1].
pub(crate) const POSITION_MAX: f64 = 1e3;

/// Largest speed limit [rad/s or m/s].
pub(crate) const SPEED_MAX: f64 = 1e6;

/// Largest effort limit [N m or N].
pub(crate) const EFFORT_MAX: f64 = 1e9;

/// Refuses numbers that are not finite or larger than `limit` in magnitude.
pub(crate) fn within(place: &str, numbers: &[f64], limit: f64) -> Result<(), RobotError> {
    if !numbers.iter().all(|x| x.is_finite()) {
        return Err(RobotError::NotFinite { place: place.to_owned() });
    }
    match numbers.iter().find(|x| x.abs() > limit) {
        Some(x) => Err(RobotError::TooLarge {
            place: place.to_owned(),
            number: format!("{x:e}"),
            limit: format!("{limit:e}"),
        }),
        None => Ok(()),
    }
}

/// Checks the mass and the inertia of a link, also of one that does not move.
pub(crate) fn check_inertial(link: &urdf_rs::Link) -> Result<(), RobotError> {
    let place = format!("inertia of link `{}`", link.name);
    let i = &link.inertial.inertia;
    within(&place, &[link.inertial.mass.value], MASS_MAX)?;
    if link.inertial.mass.value < 0.0 {
        return Err(RobotError::Inertia { link: link.name.clone(), problem: "the mass is negative" });
    }
    within(&place, &[i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz], INERTIA_MAX)
}
