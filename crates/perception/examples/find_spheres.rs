//! Finds an apple in a depth image. The image is made here: a ball in front of a wall.
use orchard_geometry::{DepthImage, Intrinsics, Vec3};
use orchard_perception::{DetectorConfig, detect};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A camera of 192 x 144 pixels with a vertical field of view of 75 degrees; camera frame: x right, y down, z ahead.
    let camera = Intrinsics::from_vertical_fov(192, 144, 75_f64.to_radians());
    let (p_camera, radius, wall) = (Vec3::new(0.05, -0.02, 0.6), 0.035, 1.2);

    // Depth of each pixel [m]: the near side of the ball where the ray (x, y, 1) meets it, else the wall.
    let mut depth = DepthImage::filled(camera.width, camera.height, wall as f32);
    for v in 0..camera.height {
        for u in 0..camera.width {
            let ray = camera.ray(u as f64, v as f64);
            let (a, b) = (ray.norm_squared(), ray.dot(&p_camera));
            let discriminant = b * b - a * (p_camera.norm_squared() - radius * radius);
            if discriminant >= 0.0 {
                depth[(u, v)] = ((b - discriminant.sqrt()) / a) as f32;
            }
        }
    }

    let found = detect(&depth, &camera, None, &DetectorConfig::paper())?;
    for apple in &found {
        println!("centre {:.4?} m, radius {:.4} m", apple.p_camera.as_slice(), apple.radius);
    }
    assert_eq!(found.len(), 1);
    assert!((found[0].p_camera - p_camera).norm() < 1e-4 && (found[0].radius - radius).abs() < 1e-4);
    Ok(())
}
