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
