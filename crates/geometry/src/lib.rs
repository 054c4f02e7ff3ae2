//! Poses, shapes, depth images and deterministic math.
//!
//! Conventions: SI units, z up, right-handed; `p_world` is a point in the world frame, `x_world_camera` the
//! pose of the camera in the world (it maps camera coordinates to world coordinates).

pub mod aabb;
pub mod cover;
pub mod footprint;
pub mod height_field;
pub mod hull;
pub mod image;
pub mod math;
pub mod shape;

pub use aabb::Aabb;
pub use cover::{Cover, CoverError, cover};
pub use footprint::Footprint;
pub use height_field::{HeightField, HeightFieldError};
pub use hull::{ConvexHull, HullError};
pub use image::{DepthImage, Image, Intrinsics};
pub use shape::Shape;

/// A point or vector, three f64.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3 x 3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// A rotation.
pub type Rotation = nalgebra::UnitQuaternion<f64>;
/// A rigid pose.
pub type Pose = nalgebra::Isometry3<f64>;

/// Applies a pose to a point.
#[inline]
pub fn transform(x: &Pose, p: &Vec3) -> Vec3 {
    x.rotation * p + x.translation.vector
}

/// Applies the inverse of a pose to a point.
#[inline]
pub fn inverse_transform(x: &Pose, p: &Vec3) -> Vec3 {
    x.rotation.inverse() * (p - x.translation.vector)
}

/// Shortest rotation that turns +z into `direction` (a unit vector); for -z, half a turn about x.
#[inline]
pub fn rotation_from_z(direction: &Vec3) -> Rotation {
    let w = 1.0 + direction.z;
    if w < 1e-12 {
        return Rotation::from_quaternion(nalgebra::Quaternion::new(0.0, 1.0, 0.0, 0.0));
    }
    Rotation::from_quaternion(nalgebra::Quaternion::new(w, -direction.y, direction.x, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotation_from_z_points_along() {
        for d in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, -0.6, -0.8], [0.0, 0.0, -1.0]] {
            let d = Vec3::from(d);
            assert!((rotation_from_z(&d) * Vec3::z() - d).norm() < 1e-14);
        }
    }
}
