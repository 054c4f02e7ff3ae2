//! Pixels that belong to the robot or to the ground, from kinematics.

use orchard_geometry::{DepthImage, Image, Intrinsics, Pose, Shape, Vec3, inverse_transform};

fn mask_where(depth: &DepthImage, intrinsics: &Intrinsics, inside: impl Fn(&Vec3) -> bool) -> Image<bool> {
    let mut mask = Image::filled(depth.width(), depth.height(), false);
    for v in 0..depth.height() {
        for u in 0..depth.width() {
            let z = f64::from(depth[(u, v)]);
            if z.is_finite() && z > 0.0 {
                mask[(u, v)] = inside(&intrinsics.back_project(u as f64, v as f64, z));
            }
        }
    }
    mask
}

/// True where the measured point lies inside one of the shapes grown by `margin` [m]. A shape comes with its
/// pose in the camera frame.
pub fn self_mask(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    shapes: &[(Shape, Pose)],
    margin: f64,
) -> Image<bool> {
    mask_where(depth, intrinsics, |p_camera| {
        shapes.iter().any(|(shape, x)| shape.signed_distance(&inverse_transform(x, p_camera)) <= margin)
    })
}

/// True where the measured point lies lower than `margin` [m] over flat ground. `up_camera` is the unit
/// vertical in the camera frame, `camera_height` [m] the camera's height over the ground.
pub fn ground_mask(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    up_camera: &Vec3,
    camera_height: f64,
    margin: f64,
) -> Image<bool> {
    mask_where(depth, intrinsics, |p_camera| camera_height + up_camera.dot(p_camera) <= margin)
}

/// Adds the pixels of `other` to `mask`; images of different size share their common top-left part.
pub fn add(mask: &mut Image<bool>, other: &Image<bool>) {
    for v in 0..mask.height().min(other.height()) {
        for u in 0..mask.width().min(other.width()) {
            mask[(u, v)] |= other[(u, v)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const K: Intrinsics = Intrinsics { width: 3, height: 3, fx: 1.0, fy: 1.0, cx: 1.0, cy: 1.0 };

    #[test]
    fn robot_pixels_are_those_inside_the_grown_shape() {
        // Points (u - 1, v - 1, 1); the ball about (1, 1, 1) reaches its two neighbours once grown to 1.
        let depth = DepthImage::filled(3, 3, 1.0);
        let ball = (Shape::Sphere { radius: 0.9 }, Pose::translation(1.0, 1.0, 1.0));
        let masked = |margin| -> Vec<usize> {
            let mask = self_mask(&depth, &K, std::slice::from_ref(&ball), margin);
            (0..9).filter(|&i| mask.pixels()[i]).collect()
        };
        assert_eq!(masked(0.0), [8]);
        assert_eq!(masked(0.11), [5, 7, 8]);
    }

    #[test]
    fn ground_pixels_are_the_low_ones() {
        // Camera level, 1 m high: rows at heights 2, 1 and 0.
        let mut depth = DepthImage::filled(3, 3, 1.0);
        depth[(1, 2)] = 0.0;
        let mask = ground_mask(&depth, &K, &Vec3::new(0.0, -1.0, 0.0), 1.0, 0.05);
        assert_eq!((0..9).filter(|&i| mask.pixels()[i]).collect::<Vec<_>>(), [6, 8]);
        let mut both = self_mask(&depth, &K, &[], 0.0);
        add(&mut both, &mask);
        assert_eq!(both, mask);
    }
}
