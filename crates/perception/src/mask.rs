//! Masks of the pixels that belong to the robot or to the ground, from kinematics.

use crate::cloud::Rectangle;
use orchard_geometry::{Aabb, DepthImage, Image, Intrinsics, Pose, Shape, Vec3, transform};

/// Returns the robot mask: true where the measured point lies inside one of the shapes grown by `margin` \[m\]. Each shape comes with its
/// pose in the camera frame.
pub fn self_mask(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    shapes: &[(Shape, Pose)],
    margin: f64,
) -> Image<bool> {
    let mut mask = Image::filled(depth.width(), depth.height(), false);
    for (shape, x_camera_shape) in shapes {
        // Half a micrometre is far above the rounding error of a box.
        let bounds = shape.aabb(x_camera_shape).grown(margin + 5e-7);
        let x_shape_camera = x_camera_shape.inverse();
        let Rectangle { u, v } = shadow(&bounds, intrinsics, depth);
        for v in v.0..v.1 {
            for u in u.0..u.1 {
                let z = f64::from(depth[(u, v)]);
                // NaN lies in no interval.
                if z > 0.0 && z.is_finite() && (bounds.min.z..=bounds.max.z).contains(&z) && !mask[(u, v)] {
                    let p_camera = intrinsics.back_project(u as f64, v as f64, z);
                    mask[(u, v)] = shape.signed_distance(&transform(&x_shape_camera, &p_camera)) <= margin;
                }
            }
        }
    }
    mask
}

/// Returns the pixels whose rays can meet a box in the camera frame; the whole image if the box reaches behind the camera.
fn shadow(bounds: &Aabb, k: &Intrinsics, depth: &DepthImage) -> Rectangle {
    let Aabb { min, max } = bounds;
    let (width, height) = (depth.width(), depth.height());
    if min.z.is_nan() || min.z <= 0.0 {
        return Rectangle { u: (0, width), v: (0, height) };
    }
    // A slope is extreme at the near end on its own side of the axis and at the far end on the other.
    let slopes = |low: f64, high: f64| {
        let least = if low < 0.0 { low / min.z } else { low / max.z };
        let most = if high > 0.0 { high / min.z } else { high / max.z };
        (least, most)
    };
    let span = |(low, high): (f64, f64), f: f64, c: f64, n: usize| {
        // A float-to-integer cast saturates. One pixel more on either side covers rounding.
        let end = ((high * f + c).floor() + 2.0).max(0.0).min(n as f64) as usize;
        ((((low * f + c).ceil() - 1.0).max(0.0) as usize).min(end), end)
    };
    Rectangle {
        u: span(slopes(min.x, max.x), k.fx, k.cx, width),
        v: span(slopes(min.y, max.y), k.fy, k.cy, height),
    }
}

/// Returns the ground mask: true where the measured point lies at most `margin` \[m\] above flat ground. `up_camera` is the unit vector
/// upwards in the camera frame, `camera_height` the camera's height above the ground \[m\].
pub fn ground_mask(
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    up_camera: &Vec3,
    camera_height: f64,
    margin: f64,
) -> Image<bool> {
    // up.p = z (up.x x/z + up.y y/z + up.z): the slopes are those of columns and rows.
    let rise_x: Vec<f64> =
        (0..depth.width()).map(|u| up_camera.x * intrinsics.ray(u as f64, 0.0).x).collect();
    let mut mask = Image::filled(depth.width(), depth.height(), false);
    let rows =
        depth.pixels().chunks(depth.width().max(1)).zip(mask.pixels_mut().chunks_mut(depth.width().max(1)));
    for (v, (zs, out)) in rows.enumerate() {
        let rise_y = up_camera.y * intrinsics.ray(0.0, v as f64).y + up_camera.z;
        for ((&z, out), rise_x) in zs.iter().zip(out).zip(&rise_x) {
            let z = f64::from(z);
            *out = z > 0.0 && z.is_finite() && camera_height + z * (rise_x + rise_y) <= margin;
        }
    }
    mask
}

/// Adds the masked pixels of `other` to `mask`; of images of different size the common top-left part counts.
pub fn add(mask: &mut Image<bool>, other: &Image<bool>) {
    if mask.width() == other.width() {
        mask.pixels_mut().iter_mut().zip(other.pixels()).for_each(|(mask, other)| *mask |= other);
        return;
    }
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

    /// The mask equals that of a test of every pixel: the bounding boxes only save work.
    #[test]
    fn bounds_lose_no_pixel() {
        let k = Intrinsics { width: 40, height: 30, fx: 22.0, fy: 25.0, cx: 18.7, cy: 15.2 };
        let z = |i: usize| 0.2 + 0.002 * ((i * 7919) % 1000) as f32;
        let depth = DepthImage::from_pixels(40, 30, (0..1200).map(z).collect()).unwrap();
        let shapes = [
            Shape::Sphere { radius: 0.2 },
            Shape::Capsule { radius: 0.1, length: 0.8 },
            Shape::Box { half: Vec3::new(0.3, 0.1, 0.05) },
            Shape::HalfSpace,
        ];
        let mut count = 0;
        for (i, shape) in shapes.iter().cycle().take(80).enumerate() {
            let at = |k: usize| ((i * 37 + k * 101) % 97) as f64 / 97.0 - 0.5;
            let turn = Vec3::new(at(3), at(4), at(5)) * 4.0;
            let pose = Pose::new(Vec3::new(2.0 * at(0), 2.0 * at(1), 1.0 + 2.4 * at(2)), turn);
            let mask = self_mask(&depth, &k, &[(shape.clone(), pose)], 0.015);
            for v in 0..30 {
                for u in 0..40 {
                    let p_camera = k.back_project(u as f64, v as f64, f64::from(depth[(u, v)]));
                    let distance = shape.signed_distance(&transform(&pose.inverse(), &p_camera));
                    // Within rounding of the margin both answers are right.
                    if (distance - 0.015).abs() > 1e-12 {
                        assert_eq!(mask[(u, v)], distance <= 0.015, "{shape:?} {u} {v}");
                    }
                    count += usize::from(mask[(u, v)]);
                }
            }
        }
        assert!(count > 5000, "{count}");
    }
}
