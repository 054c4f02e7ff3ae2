//! Formats of vectors and numbers in result files.

use orchard_geometry::Vec3;

/// A vector as written in files.
pub(crate) fn array(v: &Vec3) -> [f64; 3] {
    [v.x, v.y, v.z]
}

/// Returns a number, or `None` if it is not finite: JSON has no NaN.
pub(crate) fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

/// The larger number; NaN if either is (`max` would drop it), so that it is written as null.
pub(crate) fn larger(old: f64, new: f64) -> f64 {
    if new > old || new.is_nan() { new } else { old }
}
